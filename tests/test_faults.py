"""A few of the faults, a bug that they find, and the means: `make faults` injects them all."""

import faults
import pytest

from hardwall.hdl.supervisor import Supervisor
from hardwall.model.supervisor import CAUSES
from injection.every import FAULTS
from injection.fault import Outcome
from injection.run import run
from oracles.supervised import BITS
from proofs.bugs import Bug

QUICK = (
    "both channels change at once: the scale slips by two counts",
    "the loop of external_fault opens",
    "the loop of drive_enable opens",
    "the host acknowledges other causes",
    "the clock stops while the drive's pin is high",
)
MASKED = Bug(
    Supervisor.elaborate,
    "self.supervisor_causes | REQUIRED)",
    f"self.supervisor_causes | REQUIRED) & ~{BITS['external_fault']}",
)
"""A supervisor that does not hear of an external fault."""


def chosen(*names: str) -> list:
    return [fault for fault in FAULTS if fault.name in names]


@pytest.mark.rtl
def test_the_quick_ones_are_safe():
    outcomes = run(chosen(*QUICK))
    assert len(outcomes) == len(QUICK)
    assert {outcome.name: outcome.wrong for outcome in outcomes if not outcome.safe} == {}


@pytest.mark.rtl
def test_a_cause_that_is_masked_is_found():
    deaf, heard = run(chosen(*QUICK[1:3]), MASKED)
    assert deaf.wrong[:2] == ("ARMED, not external_fault", "the drive is not down within 3 clocks")
    assert heard.safe


def test_every_cause_is_expected_of_a_fault():
    assert {name for fault in FAULTS for name in fault.expected.causes} == {cause.name for cause in CAUSES}


def test_every_fault_has_a_name_of_its_own():
    assert len({fault.name for fault in FAULTS}) == len(FAULTS)


@pytest.mark.parametrize(("wrong", "last"), [((), "1 safe"), (("the force is not as before",), "0 safe")])
def test_the_command_ends_in_a_line_for_a_script(wrong, last, monkeypatch, capsys):
    given = []

    def came(some):
        given.extend(some)
        return [Outcome("a", "ARMED", "ARMED", 3, 11.7, 1e-3, 4.0, wrong)]

    monkeypatch.setattr(faults, "run", came)
    code = faults.main("the loop of e")
    assert [fault.name for fault in given] == ["the loop of external_fault opens", "the loop of emergency_stop opens"]
    assert capsys.readouterr().out.splitlines()[-1] == f"faults: 1 faults, {last}"
    assert code == len(wrong)
