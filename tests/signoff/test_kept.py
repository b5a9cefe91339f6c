"""What a task has found is kept whole, and only for what it came from."""

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
    findings = Findings(tmp_path / "prove")
    assert findings.of("link/uart", one) is None
    findings.keep("link/uart", one, [["a", 1.5, None]])
    assert findings.of("link/uart", one) == [["a", 1.5, None]]
    assert findings.of("link/uart", other) is None
    assert findings.of("link/line", one) is None
    assert Findings(tmp_path / "coverage").of("link/uart", one) is None
    # Found anew, it is kept all the same.
    again = Findings(tmp_path / "prove", again=True)
    assert again.of("link/uart", one) is None
    again.keep("link/uart", other, 3)
    assert findings.of("link/uart", other) == 3


def test_what_was_found_later_takes_its_place_and_leaves_no_half(tmp_path):
    findings = Findings(tmp_path / "in" / "prove")
    for found in (1, 2):
        findings.keep("sqrt", digest_of(found), found)
    assert findings.of("sqrt", digest_of(2)) == 2
    assert {path.name for path in (tmp_path / "in" / "prove").iterdir()} == {"sqrt.json"}


def test_a_block_has_a_file_whatever_is_asked_of_it(tmp_path):
    findings = Findings(tmp_path)
    names = ["link/uart, 500 kHz: it is idle", "link/uart, 500 kHz: it is ready", "ECP5 axis", "sqrt"]
    for name in reversed(names):
        findings.keep(name, "0f", [name])
    files = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*.json")}
    assert files == {"link-uart-500-kHz.json", "ECP5-axis.json", "sqrt.json"}
    assert [*findings.every().items()] == [(name, {"digest": "0f", "found": [name]}) for name in sorted(names)]


def test_findings_of_many_at_a_time_are_all_kept(tmp_path):
    names = [f"block: property {n}" for n in range(40)]
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda name: Findings(tmp_path).keep(name, "0f", [name]), names))
    assert {name: each["found"] for name, each in Findings(tmp_path).every().items()} == {n: [n] for n in names}


def test_nothing_is_kept_without_a_folder():
    findings = Findings()
    findings.keep("sqrt", "0f", 1)
    assert findings.of("sqrt", "0f") is None
    assert findings.every() == {}


@pytest.mark.parametrize("name", USUAL)
def test_with_another_seed_or_length_the_project_keeps_its_own(name, monkeypatch):
    for each in USUAL:
        monkeypatch.delenv(each, raising=False)
    assert findings_of("gate")._folder == OURS / "gate"
    monkeypatch.setenv(name, "2")
    assert findings_of("gate")._folder == build_dir() / "findings" / "gate"


def test_the_projects_findings_are_of_what_there_is_and_each_in_its_place():
    blocks = {block.name for block in BLOCKS}
    there = {
        "prove": {known.title for known in PROPERTIES},
        "faults": {f"{stage}: {fault.name}" for stage, faults in FAULTS.items() for fault in faults},
        "gate": {case.name for case in CASES},
        "coverage": blocks,
        "mutate": blocks,
    }
    assert {folder.name for folder in OURS.iterdir()} == {*there}
    for task, names in there.items():
        findings = Findings(OURS / task)
        kept = findings.every()
        assert {*kept} - names == set(), f"{task} has these"
        assert all(findings.of(name, each["digest"]) == each["found"] for name, each in kept.items())
        assert {path.suffix for path in (OURS / task).rglob("*.*")} == {".json"}
