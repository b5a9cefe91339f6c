"""Requests of a beat go before those of others, which do not wait for ever."""

import threading
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from hardwall.host.port import Port
from hardwall.host.precedence import Precedence
from hardwall.host.requests import Sending
from host.twin_board import PATIENT

LONG_S, SHORT_S = 600.0, 0.05


@pytest.fixture
def port(board):
    line = Port(board.name, **PATIENT)
    yield line
    line.close()


def test_its_own_thread_does_not_wait_and_another_one_does():
    precedence = Precedence()
    precedence.wait(LONG_S)
    with ThreadPoolExecutor(1) as other:
        with precedence.taken():
            precedence.wait(LONG_S)
            waits = other.submit(precedence.wait, LONG_S)
            time.sleep(SHORT_S)
            assert not waits.done()
        waits.result()
        began_s = time.monotonic()
        with precedence.taken():
            other.submit(precedence.wait, SHORT_S).result()
        assert time.monotonic() - began_s >= SHORT_S
        precedence.wait(LONG_S)


def test_what_is_asked_waits_for_a_beat_and_what_is_written_at_once_does_not(board, port, registers, monkeypatch):
    monkeypatch.setattr("hardwall.host.port.BEAT_S", LONG_S)
    disarm, began = registers["disarm"].address, threading.Event()
    with ThreadPoolExecutor(2) as others:

        def read() -> tuple[int, ...]:
            began.set()
            return port.read(4, 2)

        with port.first():
            expected = port.read(4, 2)
            asked = others.submit(read)
            began.wait()
            others.submit(port.write, disarm, (1,), Sending(at_once=True)).result()
            assert not asked.done()
        assert asked.result() == expected
