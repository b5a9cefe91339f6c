"""The store of results that take time: kept as they come, found again, and discarded when the sources change."""

import multiprocessing
import os

import pytest

from hardwall import sim
from hardwall.model.runtime import build_folder, termination
from hardwall.sim.jobs import parallel, store
from hardwall.sim.jobs.store import Store


@pytest.fixture(autouse=True)
def elsewhere(fresh, tmp_path, monkeypatch):
    """Let the folder be the one that a user names, as it is outside of tests."""
    monkeypatch.setattr(store, "build_dir", build_folder.build_dir)
    monkeypatch.setenv("HARDWALL_BUILD", str(tmp_path))


def square(number: int) -> dict:
    if number < 0:
        raise ValueError(f"number must be 0 or more, not {number}")
    return {"square": number**2}


def refuse(number: int) -> dict:
    raise AssertionError(f"{number} was computed again")


def test_what_was_put_is_there_for_the_next(tmp_path):
    Store("some").put({"b": 1, "a": None}, [1.5, "x"])
    assert Store("some").get({"a": None, "b": 1}) == [1.5, "x"]
    assert Store("some").get({"a": None, "b": 2}) is None
    assert Store("other").get({"a": None, "b": 1}) is None
    assert list(tmp_path.rglob("*.jsonl")) == [Store("some").path]


def test_a_line_that_was_cut_off_is_no_result_and_spoils_none():
    kept = Store("some")
    kept.put({"a": 1}, 1)
    kept.put({"a": 2}, 2)
    kept.path.write_text(kept.path.read_text()[:-4])
    again = Store("some")
    assert (again.get({"a": 1}), {"a": 2} in again) == (1, False)
    again.put({"a": 2}, 2)
    assert Store("some").get({"a": 2}) == 2


def test_a_pipe_in_the_place_of_the_store_is_not_waited_for(caplog):
    path = Store("some").path
    path.parent.mkdir()
    os.mkfifo(path)
    kept = Store("some")
    kept.put({"a": 1}, 1)
    assert kept.get({"a": 1}) == 1
    (said,) = caplog.messages
    assert said.endswith("cannot be written (No such device or address): what this run makes is not kept")


def test_a_store_that_is_too_large_is_not_read(monkeypatch):
    Store("some").put({"a": 1}, 1)
    monkeypatch.setattr(store, "BYTES_MAX", 4)
    assert Store("some").get({"a": 1}) is None


NO_RESULTS = {
    "a number": b"5", "a list": b"[1]", "nothing": b"null", "a text": b'"abc"',
    "an object": b'{"a": 1, "b": 2, "c": 3}',
    "old form": b'["0123456789abcdef0123456789abcdef", 5]', "a key of a wrong kind": b'["a", ["b"], 5]',
    "not UTF-8": b"\xff\xfe\x80", "NUL": b"\0", "blanks": b"  ", "deep": b"[" * 100_000, "long": b"[1" + b"0" * 9999,
    "a line of another system": b'["a", "b", 5]\r',
}  # fmt: skip


@pytest.mark.parametrize("line", NO_RESULTS.values(), ids=NO_RESULTS)
def test_a_line_that_is_no_result_is_skipped_and_one_line_says_so(line, caplog):
    kept = Store("some")
    kept.put({"a": 1}, 1)
    with kept.path.open("ab") as file:
        file.write(b"\n" + line)
    kept.put({"a": 2}, 2)
    again = Store("some")
    assert (again.get({"a": 1}), again.get({"a": 2})) == (1, 2)
    assert caplog.messages == [f"{kept.path}: 1 line that is no result was skipped"]


def test_all_that_is_skipped_is_counted(caplog):
    kept = Store("some")
    kept.put({"a": 1}, 1)
    with kept.path.open("ab") as file:
        file.writelines(b"\n" + line for line in NO_RESULTS.values())
    assert Store("some").get({"a": 1}) == 1
    assert caplog.messages == [f"{kept.path}: {len(NO_RESULTS)} lines that are no results were skipped"]


@pytest.mark.parametrize("result", [{"rms": 1.5, "ok": True}, [float("nan"), -0.0, 1e-320], {"1": None}, "ünï\n\u2028"])
def test_a_result_comes_back_as_it_was(result, caplog):
    Store("some").put({"a": 1}, result)
    assert repr(Store("some").get({"a": 1})) == repr(result)
    assert caplog.messages == []


def test_a_result_that_was_edited_is_computed_again():
    kept = Store("squares")
    kept.put({"number": 7}, {"square": 49})
    kept.path.write_text(kept.path.read_text().replace('{"square": 49}', "5"))
    assert parallel.run(square, [{"number": 7}], Store("squares")) == [{"square": 49}]
    assert Store("squares").get({"number": 7}) == {"square": 49}


@pytest.fixture
def unsaid(monkeypatch):
    """Forget what this process has warned of."""
    monkeypatch.setattr(build_folder, "_said", set())


def test_results_that_are_kept_are_counted():
    termination.begin()
    Store("some").put({"a": 1}, 1)
    Store("some").put({"a": 2}, 2)
    assert termination.remark().startswith("; 2 new results are kept")


def test_without_a_place_to_keep_them_results_are_used_and_one_line_says_so(tmp_path, monkeypatch, caplog, unsaid):
    termination.begin()
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("HARDWALL_BUILD", str(tmp_path / "file"))
    kept = Store("squares")
    jobs = [{"number": number} for number in (1, 2, 3)]
    assert parallel.run(square, jobs, kept, 1) == [{"square": 1}, {"square": 4}, {"square": 9}]
    assert caplog.messages == [f"{kept.path} cannot be written (Not a directory): what this run makes is not kept"]
    assert termination.remark() == "", "nothing is kept"


@pytest.mark.skipif(not os.access("/dev/full", os.W_OK), reason="this system has no /dev/full")
def test_on_a_full_disk_results_are_used_and_one_line_says_so(caplog, unsaid):
    kept = Store("squares")
    kept.path.parent.mkdir(parents=True)
    kept.path.symlink_to("/dev/full")
    kept.put({"number": 1}, {"square": 1})
    assert kept.get({"number": 1}) == {"square": 1}
    reason = "No space left on device"
    assert caplog.messages == [f"{kept.path} cannot be written ({reason}): what this run makes is not kept"]


def put_many(first: int) -> None:
    kept = Store("many")
    for number in range(first, first + 50):
        kept.put({"number": number}, "x" * 20_000)


def test_processes_that_put_at_once_lose_nothing(caplog):
    with multiprocessing.get_context("fork").Pool(4) as pool:
        pool.map(put_many, range(0, 400, 50))
    kept = Store("many")
    assert sum({"number": number} in kept for number in range(400)) == 400
    assert caplog.messages == []


def test_nothing_is_a_result_too():
    Store("some").put({"a": 1}, None)
    assert {"a": 1} in Store("some")


def test_other_sources_begin_anew(monkeypatch):
    Store("some").put({"a": 1}, 1)
    monkeypatch.setattr(store, "sources", lambda: "others")
    assert Store("some").get({"a": 1}) is None


def test_sources_that_changed_since_the_program_began_are_none_of_a_store(monkeypatch, caplog, unsaid):
    """The digest is of the sources as they are, and the program runs what they were: its results have no place."""
    Store("some").put({"a": 1}, 1)
    monkeypatch.setattr(sim, "BEGAN_NS", 0)
    monkeypatch.setattr(store, "LOOK_S", 0.0)
    kept = Store("some")
    assert {"a": 1} not in kept
    kept.put({"a": 2}, 2)
    assert kept.get({"a": 2}) == 2
    (said,) = caplog.messages
    assert said.endswith(" changed while this process ran: its results are not kept")
    monkeypatch.undo()
    monkeypatch.setenv("HARDWALL_BUILD", str(kept.path.parents[1]))
    assert ({"a": 1} in Store("some"), {"a": 2} in Store("some")) == (True, False)


def test_the_sources_are_looked_at_once_in_a_while(monkeypatch):
    looks, now = [], [0.0]

    def names():
        looks.append(now[0])
        return ()

    monkeypatch.setattr(store, "_names", names)
    monkeypatch.setattr(store, "LOOK_S", 1.0)
    monkeypatch.setattr(store.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(store, "_looked", store._Look())
    for number in range(100):
        now[0] = number / 32
        assert store.are_as_they_were()
    assert looks == [0.0, 1.0, 2.0, 3.0]


def test_a_time_in_the_future_is_that_of_another_clock(monkeypatch, caplog, unsaid):
    monkeypatch.setattr(store.time, "time_ns", lambda: 1)
    monkeypatch.setattr(sim, "BEGAN_NS", 0)
    monkeypatch.setattr(store, "LOOK_S", 0.0)
    Store("some").put({"a": 1}, 1)
    assert Store("some").get({"a": 1}) == 1
    assert caplog.messages == []


@pytest.mark.parametrize("workers", [1, 2])
def test_jobs_give_results_in_their_order_and_once(workers):
    numbers, seen = [5, 3, 5, 1], []
    jobs = [{"number": number} for number in numbers]
    assert parallel.run(square, jobs, Store("squares"), workers, seen.append) == [{"square": n**2} for n in numbers]
    assert seen[-1] == len(jobs)
    assert parallel.run(refuse, jobs, Store("squares"), workers) == [{"square": n**2} for n in numbers]


@pytest.mark.parametrize("workers", [1, 2])
def test_a_job_that_fails_ends_the_run_and_loses_none_that_was_done(workers):
    jobs = [{"number": number} for number in (1, 2, -3, 4)]
    done = []
    with pytest.raises(ValueError, match=r"^number must be 0 or more, not -3$"):
        parallel.run(square, jobs, Store("squares"), workers, done.append)
    kept = Store("squares")
    assert sum(job in kept for job in jobs) == len(done)
    assert jobs[2] not in kept
    if workers == 1:
        assert len(done) == 2
