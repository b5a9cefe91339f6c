"""A few of the faults, bugs that they find, and the means: `make faults` injects them all."""

import pytest

from hardwall.hdl.axes.board import AxesBoard
from hardwall.hdl.axes.output_gates import Doors
from hardwall.hdl.axis.supervisor import Supervisor
from hardwall.hdl.drive.dac import Dac
from hardwall.hdl.drive.pwm import Pwm
from hardwall.model.axis.supervisor import CAUSES
from oracles.supervised import BITS
from signoff import faults
from signoff.injection import run as running
from signoff.injection.all_faults import FAULTS
from signoff.injection.fault import Outcome
from signoff.injection.run import run
from signoff.injection.staged import DEVICES, SEVERAL, STAGED
from signoff.kept import Findings
from signoff.proofs.bugs import Bug
from stimuli.lengths import LONG, long_form

QUICK = (
    "both channels change at once: the scale slips by two counts",
    "the loop of external_fault opens",
    "the loop of drive_enable opens",
    "the host acknowledges other causes",
)
MASKED = Bug(
    Supervisor.elaborate,
    "self.supervisor_causes | REQUIRED)",
    f"self.supervisor_causes | REQUIRED) & ~{BITS['external_fault']}",
)
"""A supervisor that does not hear of an external fault."""


HELD = (
    (
        "pwm",
        Bug(
            Pwm._leg,
            "[high_pin.eq(high & self.permitted), low_pin.eq(low & self.permitted)]",
            "[high_pin.eq(high), low_pin.eq(low)]",
        ),
    ),
    ("dac", Bug(Dac.elaborate, "ready & self.permitted", "ready")),
)
"""Stages whose pins act on when nothing permits it, as long as no clock says so."""


QUICK_OF_AXES = (
    "both channels change at once: the scale slips by two counts",
    "the loop of external_fault opens, which the other axes take no part in",
    "the loop of emergency_stop opens",
)
(AXES,) = (name for name, device in DEVICES.items() if device is SEVERAL)
NEIGHBOURS = Bug(Doors.__init__, "Cat(each[axis] for", "Cat(each for")
"""Doors of several axes that a loop shuts which is another axis's matter."""
DEAF = Bug(AxesBoard.elaborate, "loop.replicate(self.spec.axes)", "loop.replicate(2) | 4")
"""A board whose third axis hears of no loop."""


def chosen(stage: str, *names: str) -> list:
    return [fault for fault in FAULTS[stage] if fault.name in names]


def in_the_act(stage: str) -> list:
    """Return the faults that meet the stage in the act: a clock that stops, and a loop that opens at the worst."""
    acting, worst = STAGED[stage].acting, list(STAGED[stage].moments)[-1]
    return chosen(stage, f"the clock stops {acting}", f"the loop of drive_enable opens {worst}")


@long_form
@pytest.mark.rtl
@pytest.mark.parametrize("stage", STAGED)
def test_the_quick_ones_are_safe(stage):
    """The short form has faults of several axes, and a board of one has its loops opened and its clock stopped."""
    faults = [*(chosen(stage, *QUICK) if stage == "pdm" else ()), *in_the_act(stage)]
    outcomes = run(stage, faults)
    assert len(outcomes) == len(faults) >= 2
    assert {outcome.name: outcome.wrong for outcome in outcomes if not outcome.safe} == {}


@long_form
@pytest.mark.rtl
def test_a_cause_that_is_masked_is_found():
    deaf, heard = run("pdm", chosen("pdm", *QUICK[1:3]), MASKED)
    assert deaf.wrong[:2] == ("ARMED, not external_fault", "the drive is not down within 3 clocks")
    assert heard.safe


@long_form
@pytest.mark.rtl
@pytest.mark.parametrize(("stage", "bug"), HELD)
def test_pins_that_need_a_clock_to_be_safe_are_found(stage, bug):
    opens, stands = run(stage, in_the_act(stage), bug)
    assert "the drive is not down within 72 clocks" in stands.wrong
    assert any("at the pins" in wrong for wrong in opens.wrong)


@pytest.mark.rtl
def test_faults_of_several_axes_are_safe():
    faults = [fault for fault in FAULTS[AXES] if LONG or fault.name in QUICK_OF_AXES]
    outcomes = run(AXES, faults)
    assert len(outcomes) == len(faults) >= len(QUICK_OF_AXES)
    assert {outcome.name: outcome.wrong for outcome in outcomes if not outcome.safe} == {}


@long_form
@pytest.mark.rtl
def test_an_axis_that_is_disturbed_by_another_is_found():
    (outcome,) = run(
        AXES, chosen(AXES, "the loop of external_fault opens, which the other axes take no part in"), NEIGHBOURS
    )
    assert {f"axis {axis}: the force is not as before" for axis in (0, 2)} <= {*outcome.wrong}


@long_form
@pytest.mark.rtl
def test_an_axis_that_does_not_stop_with_the_others_is_found():
    (outcome,) = run(AXES, chosen(AXES, "the loop of emergency_stop opens"), DEAF)
    assert "axis 2: ARMED, not emergency_stop" in outcome.wrong
    assert not any(wrong.startswith("axis 1") for wrong in outcome.wrong)


@pytest.mark.parametrize("stage", FAULTS)
def test_every_cause_is_expected_of_a_fault(stage):
    # The rota of several axes has a clock for each, and no sample can begin too early.
    never = {"strobe_busy"} if stage == AXES else set()
    causes = {name for fault in FAULTS[stage] for name in fault.expected.causes}
    assert causes == {cause.name for cause in CAUSES} - never


@pytest.mark.parametrize("stage", FAULTS)
def test_every_fault_has_a_name_of_its_own(stage):
    assert len({fault.name for fault in FAULTS[stage]}) == len(FAULTS[stage])


@pytest.mark.parametrize(("wrong", "last"), [((), "4 safe"), (("the force is not as before",), "0 safe")])
def test_the_command_ends_in_a_line_for_a_script(wrong, last, monkeypatch, capsys, tmp_path):
    given, findings = [], Findings(tmp_path / "faults")

    def came(stage, some):
        given.extend((stage, fault.name) for fault in some)
        return [Outcome(fault.name, "ARMED", "ARMED", 3, 11.7, 1e-3, 4.0, wrong) for fault in some]

    monkeypatch.setattr(running, "run", came)
    monkeypatch.setattr(faults, "findings_of", lambda task: findings)
    monkeypatch.setattr(running, "origin_digest", lambda stage: stage)
    killed = "the host is killed (supervisor_watchdog 50 ms)"
    for _ in range(2):
        assert faults.main("the host is k") == (1 if wrong else 0)
        assert capsys.readouterr().out.splitlines()[-1] == f"faults: 4 faults, {last}"
    # What was safe is kept, and what was not is injected again.
    assert sorted(given) == sorted([(stage, killed) for stage in FAULTS] * (2 if wrong else 1))


@long_form
def test_faults_of_other_stages_come_from_something_else():
    assert len({running.origin_digest(stage) for stage in FAULTS}) == len(FAULTS)
