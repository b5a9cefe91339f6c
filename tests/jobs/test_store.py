"""The store of results that take time: kept as they come, found again, and discarded when the sources change."""

import multiprocessing

import pytest

from hardwall.sim.jobs import parallel, store
from hardwall.sim.jobs.store import Store


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
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


def test_nothing_is_a_result_too():
    Store("some").put({"a": 1}, None)
    assert {"a": 1} in Store("some")


def test_other_sources_begin_anew(monkeypatch):
    Store("some").put({"a": 1}, 1)
    monkeypatch.setattr(store, "sources", lambda: "others")
    assert Store("some").get({"a": 1}) is None


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
    for worker in multiprocessing.active_children():
        worker.join(30)
        assert not worker.is_alive()
