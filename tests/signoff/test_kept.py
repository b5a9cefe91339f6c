"""What a task has found is kept whole, and only for what it came from."""

import json
from concurrent.futures import ThreadPoolExecutor

import pytest

from hardwall.model.runtime.build_folder import build_dir
from signoff.covering.blocks import BLOCKS
from signoff.gate import CASES
from signoff.injection.all_faults import FAULTS
from signoff.kept import OURS, USUAL, Findings, digest_of, findings_of
from signoff.proofs.properties import PROPERTIES


def test_a_finding_is_of_its_digest_alone(tmp_path):
    one, other = digest_of("text", [1, 2], b"source"), digest_of("text", [1, 3], b"source")
    assert one != other
    findings = Findings(tmp_path / "prove.json")
    assert findings.of("link/uart", one) is None
    findings.keep("link/uart", one, [["a", 1.5, None]])
    assert findings.of("link/uart", one) == [["a", 1.5, None]]
    assert findings.of("link/uart", other) is None
    assert findings.of("link/line", one) is None
    assert Findings(tmp_path / "coverage.json").of("link/uart", one) is None
    # Found anew, it is kept all the same.
    again = Findings(tmp_path / "prove.json", again=True)
    assert again.of("link/uart", one) is None
    again.keep("link/uart", other, 3)
    assert findings.of("link/uart", other) == 3


def test_what_was_found_later_takes_its_place_and_leaves_no_half(tmp_path):
    findings = Findings(tmp_path / "in" / "prove.json")
    for found in (1, 2):
        findings.keep("sqrt", digest_of(found), found)
    assert findings.of("sqrt", digest_of(2)) == 2
    assert {path.name for path in (tmp_path / "in").iterdir()} == {"prove.json"}


def test_findings_of_many_at_a_time_are_all_kept_a_line_for_each(tmp_path):
    file, names = tmp_path / "mutate.json", [f"block {n}" for n in range(40)]
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda name: Findings(file).keep(name, "0f", [name]), names))
    assert {name: each["found"] for name, each in json.loads(file.read_text()).items()} == {n: [n] for n in names}
    assert len(file.read_text().splitlines()) == len(names) + 2


def test_nothing_is_kept_without_a_file():
    findings = Findings()
    findings.keep("sqrt", "0f", 1)
    assert findings.of("sqrt", "0f") is None


@pytest.mark.parametrize("name", USUAL)
def test_with_another_seed_or_length_the_project_keeps_its_own(name, monkeypatch):
    for each in USUAL:
        monkeypatch.delenv(each, raising=False)
    assert findings_of("gate")._file == OURS / "gate.json"
    monkeypatch.setenv(name, "2")
    assert findings_of("gate")._file == build_dir() / "findings" / "gate.json"


def test_the_projects_findings_are_whole():
    for file in sorted(OURS.glob("*.json")):
        for name, each in json.loads(file.read_text(encoding="utf-8")).items():
            assert sorted(each) == ["digest", "found"], f"{file.name}: {name}"


def test_the_projects_findings_are_of_what_there_is():
    blocks = {block.name for block in BLOCKS}
    there = {
        "prove": {known.name for known in PROPERTIES},
        "faults": {f"{stage}: {fault.name}" for stage, faults in FAULTS.items() for fault in faults},
        "gate": {case.name for case in CASES},
        "coverage": blocks,
        "mutate": blocks,
    }
    for file in OURS.glob("*.json"):
        assert {*json.loads(file.read_text(encoding="utf-8"))} - there[file.stem] == set(), f"{file.name} has these"
