"""What a task has found is kept whole, and only for what it came from."""

import pytest
from kept import digest_of, keep, kept_of


@pytest.fixture(autouse=True)
def folder(monkeypatch, tmp_path):
    monkeypatch.setenv("HARDWALL_BUILD", str(tmp_path))
    return tmp_path


def test_a_finding_is_of_its_digest_alone():
    one, other = digest_of("text", [1, 2], b"source"), digest_of("text", [1, 3], b"source")
    assert one != other
    assert kept_of("prove", "link/uart", one) is None
    keep("prove", "link/uart", one, [["a", 1.5, None]])
    assert kept_of("prove", "link/uart", one) == [["a", 1.5, None]]
    assert kept_of("prove", "link/uart", other) is None
    assert kept_of("prove", "link/line", one) is None
    assert kept_of("coverage", "link/uart", one) is None


def test_what_was_found_later_takes_its_place_and_leaves_no_half(folder):
    for found in (1, 2):
        keep("prove", "sqrt", digest_of(found), found)
    assert kept_of("prove", "sqrt", digest_of(2)) == 2
    assert [path.name for path in (folder / "prove").iterdir()] == ["sqrt.json"]
