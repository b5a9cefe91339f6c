"""Clusters that do not answer, that are no clusters, that lose their workers or their scheduler."""

import json
import socket
import sys
import threading
from collections.abc import Callable
from concurrent.futures import CancelledError, Future
from contextlib import contextmanager
from functools import partialmethod

import pytest
from distributed import Client, LocalCluster
from distributed.scheduler import KilledWorker

from hardwall.sim.jobs import cluster
from support.command_line import call
from support.processes import line, started

LOCAL = {"threads_per_worker": 1, "dashboard_address": ":0"}


@contextmanager
def listening(answer):
    """Provide the address of a listener, and hand it connections in a thread."""
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def serve():
            while True:
                try:
                    connection, _ = listener.accept()
                    kept.append(connection)
                    answer(connection)
                except OSError:
                    return

        kept: list[socket.socket] = []
        threading.Thread(target=serve, daemon=True).start()
        yield f"tcp://127.0.0.1:{listener.getsockname()[1]}"
        listener.shutdown(socket.SHUT_RDWR)
        for connection in kept:
            connection.close()


ANSWERS = {
    "nothing": lambda connection: None,
    "the end": lambda connection: connection.close(),
    "another protocol": lambda connection: connection.sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n" * 9),
    "garbage": lambda connection: connection.sendall(bytes(range(256)) * 9),
    "a short frame": lambda connection: connection.sendall(b"\1" + bytes(7) + b"\5" + bytes(7) + b"hello"),
    "an echo": lambda connection: connection.sendall(connection.recv(1 << 16)),
}


@pytest.mark.parametrize("answer", ANSWERS)
def test_who_does_not_answer_as_a_scheduler_is_none(monkeypatch, capsys, answer):
    monkeypatch.setattr(cluster, "TIMEOUT_S", 1.0)
    with listening(ANSWERS[answer]) as address:
        code, out, err = call(monkeypatch, capsys, "zwidth", "--scheduler", address)
    assert (code, out) == (1, "")
    assert err.startswith(f"hardwall: error: no Dask scheduler answers at {address}: ")
    assert err.count("\n") == 1


def test_a_scheduler_that_wants_certificates_needs_some(monkeypatch, capsys):
    monkeypatch.setattr(cluster, "TIMEOUT_S", 1.0)
    code, out, err = call(monkeypatch, capsys, "zwidth", "--scheduler", "tls://127.0.0.1:8786")
    assert (code, out) == (1, "")
    assert err.startswith("hardwall: error: no Dask scheduler answers at tls://127.0.0.1:8786: TLS ")
    assert err.count("\n") == 1


NO_HOSTS = ["tcp://ho\nst:80", "a b:80", "tcp://a..b:80", "tcp://.:80", ".a:80", "\udcff:80"]
LONG = ["tcp://" + "a" * 3000 + ":80", "tcp://" + "a." * 127 + "a:80"]
"""The names of hosts have 63 characters to a dot, and 253 in all."""


@pytest.mark.parametrize("address", [*NO_HOSTS, *LONG])
def test_what_no_host_is_called_is_no_address(address):
    with pytest.raises(cluster.AddressError, match=r"^must be an address such as tcp://10\.0\.0\.7:8786, not "):
        cluster.check_address(address)


@pytest.mark.parametrize(
    "address",
    [*("abc", "", "tcp://", "tcp://a", "ftp://a:1", "a:0", "a:65536", ":8786", "::1:9"), *NO_HOSTS],
)
@pytest.mark.parametrize("command", ["zwidth", "fit", "rates"])
def test_what_is_no_address_is_refused_before_any_work(monkeypatch, capsys, address, command):
    monkeypatch.setattr(cluster, "connected", lambda *_: pytest.fail("it connects"))
    expected = f"hardwall: error: --scheduler must be an address such as tcp://10.0.0.7:8786, not {address!r}\n"
    assert call(monkeypatch, capsys, command, "--scheduler", address) == (2, "", expected)


@pytest.mark.parametrize(
    "address",
    [
        *("tcp://10.0.0.7:8786", "node-7:8786", "tls://[::1]:8786", "tcp://[fe80::1%eth0]:8786"),
        *("tcp://node.example.:8786", "tcp://b\xfccher.example:80"),
        *("tcp://" + "a." * 126 + "a:80", "tcp://" + "a." * 127 + ":80"),
    ],
)
def test_what_is_an_address_is_accepted(address):
    cluster.check_address(address)


def test_a_scheduler_without_workers_is_a_failure(monkeypatch, capsys):
    monkeypatch.setattr(cluster, "TIMEOUT_S", 1.0)
    with LocalCluster(n_workers=0, **LOCAL) as local:
        address = local.scheduler_address
        code, out, err = call(monkeypatch, capsys, "zwidth", "--scheduler", address)
    assert (code, out) == (1, "")
    assert err == f"hardwall: error: the Dask scheduler at {address} has no workers\n"


def test_a_scheduler_that_is_not_there_is_a_failure(monkeypatch, capsys):
    monkeypatch.setattr(cluster, "TIMEOUT_S", 1.0)
    code, out, err = call(monkeypatch, capsys, "zwidth", "--scheduler", "tcp://127.0.0.1:1")
    assert (code, out) == (1, "")
    assert err.startswith("hardwall: error: no Dask scheduler answers at tcp://127.0.0.1:1: ")


def wait_for_nobody(address: str, monkeypatch, happens: Callable[[], object]) -> None:
    """Wait for a job that no worker takes, while something happens to the cluster."""
    with cluster.connected(address) as pool:
        pool.give("taken", json.dumps, {"obj": 7})
        assert pool.take() == ("taken", "7")
        monkeypatch.setattr(Client, "submit", partialmethod(Client.submit, workers=["nowhere"]))
        pool.give("not taken", json.dumps, {"obj": 8})
        happens()
        pool.take()


def test_a_cluster_that_loses_its_workers_is_left(monkeypatch):
    monkeypatch.setattr(cluster, "TIMEOUT_S", 30.0)
    monkeypatch.setattr(cluster, "PATIENCE_S", 1.0)
    monkeypatch.setattr(cluster, "POLL_S", 0.1)
    with LocalCluster(n_workers=1, processes=False, protocol="tcp", **LOCAL) as local:
        message = f"^the Dask cluster at {local.scheduler_address} has had no worker for 1 s$"
        with pytest.raises(RuntimeError, match=message):
            wait_for_nobody(local.scheduler_address, monkeypatch, lambda: local.scale(0))


SCHEDULER = """
from distributed import LocalCluster
import sys, time
with LocalCluster(n_workers=1, processes=False, protocol="tcp", dashboard_address=None) as local:
    print(local.scheduler_address, flush=True)
    time.sleep(600)
"""


def test_a_scheduler_that_is_killed_is_a_failure_in_a_line(monkeypatch, capfd):
    monkeypatch.setattr(cluster, "TIMEOUT_S", 30.0)
    with started(sys.executable, "-c", SCHEDULER) as scheduler:
        address = line(scheduler)
        with pytest.raises(RuntimeError, match=r"^the connection to the Dask scheduler is lost$"):
            wait_for_nobody(address, monkeypatch, scheduler.kill)
    assert capfd.readouterr() == ("", "")


def test_a_job_for_a_scheduler_that_was_killed_fails_in_a_line_too(monkeypatch, capfd):
    """The client does not know yet, or connects again and again; what Dask says of the job is not for the user."""
    monkeypatch.setattr(cluster, "TIMEOUT_S", 30.0)
    monkeypatch.setattr(cluster, "PATIENCE_S", 1.0)
    monkeypatch.setattr(cluster, "POLL_S", 0.1)

    def give_late() -> None:
        with cluster.connected(address) as pool:
            pool.give("taken", json.dumps, {"obj": 7})
            assert pool.take() == ("taken", "7")
            scheduler.kill()
            scheduler.wait()
            pool.give("late", json.dumps, {"obj": 8})
            pool.take()

    with started(sys.executable, "-c", SCHEDULER) as scheduler:
        address = line(scheduler)
        message = rf"^{cluster.LOST}$|^the Dask cluster at {address} has had no worker for 1 s$"
        with pytest.raises(RuntimeError, match=message):
            give_late()
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (CancelledError("dumps-02ae cancelled for reason: unknown."), cluster.LOST),
        (
            KilledWorker("dumps-02ae", None, 3),
            "the Dask cluster could not run a hit: its workers end while they run it",
        ),
        (ModuleNotFoundError("No module named 'a'", name="a"), "the Dask cluster could not run a hit: a worker has no"),
    ],
)
def test_what_dask_says_of_a_job_is_put_in_words(error, said):
    future = Future()
    future.set_exception(error)
    with pytest.raises(RuntimeError, match=f"^{said}"):
        cluster.result_of(future)
