"""What supervised axes in a rota promise, each of them, from the pins to the drive that may leave the FPGA."""

from unittest import mock

from amaranth.asserts import AnySeq
from amaranth.hdl import Module, Mux, Shape, Signal, Value
from amaranth.lib.wiring import Out

from hardwall.hdl.axes import pending_pulses as gathered
from hardwall.hdl.axes import pipe
from hardwall.hdl.axes import supervised as supervised_axes
from hardwall.hdl.axes.axis import Axes
from hardwall.hdl.axes.output_gates import Doors
from hardwall.hdl.axes.pipe import Pipe
from hardwall.hdl.axes.supervised import SupervisedAxes
from hardwall.hdl.axes.supervisor import Supervisors
from hardwall.hdl.axis.supervised import LOOPS
from hardwall.model.axes.axis import AxesSpec
from hardwall.model.axes.supervised import LET_OUT, LOOK
from hardwall.model.axis.supervisor import ARMED, DISARMED, TRIPPED
from stimuli.specs import NARROW

from .bench import Bench
from .bugs import Bug
from .property import Property

WHERE = "supervised axes narrow"
NUMBER = 2


class Registers:
    """A word for every axis in registers of any contents, in the place of the memory that a `Kept` has.

    The memory is read within the clock and written at its end, as registers are; of these a proof can say something.
    """

    def __init__(self, of: Pipe, name: str, shape: Shape | int):
        self._pipe = of
        self._rows = [Signal(shape, name=f"{name}_{axis}", reset_less=True) for axis in range(of.axes)]

    def read(self, stage: int) -> Value:
        return self._pipe.of(self._rows, stage)

    def write(self, value: Value, axis: Value, enable: Value) -> None:
        for number, row in enumerate(self._rows):
            with self._pipe.m.If(enable & (axis == number)):
                self._pipe.m.d.sync += row.eq(value)

    def leave(self, stage: int, value: Value) -> None:
        self.write(value, self._pipe.axis(stage), self._pipe.valid(stage))


class FreeAxes(Axes):
    """Axes that show anything at any clock, but for the rota: whatever the pipeline of axes shows, they may show it."""

    def elaborate(self, platform) -> Module:
        m, last = Module(), self.spec.clocks_per_sample - 1
        clock = Signal(range(last + 1))
        m.d.sync += [clock.eq(Mux(clock == last, 0, clock + 1)), self.word_ready.eq(self.word_ready | (clock == last))]
        m.d.comb += [self.strobe.eq(clock < self.spec.axes), self.strobe_axis.eq(clock)]
        for name, member in self.signature.members.items():
            if member.flow == Out and name not in ("word_ready", "strobe", "strobe_axis"):
                m.d.comb += Value.cast(getattr(self, name)).eq(AnySeq(Shape.cast(member.shape)))
        return m


def axes(bench: Bench) -> SupervisedAxes:
    """Return two axes with narrow words and the slowest clock, so that proofs see many turns."""
    rota = {**NARROW, "actuation_hz": NARROW["sample_hz"], "axes": NUMBER, "estimator": "fdm"}
    slots = AxesSpec(**rota).slots
    spec = AxesSpec(**{**rota, "clock_hz": slots * NARROW["sample_hz"]})
    with mock.patch.object(pipe, "Kept", Registers), mock.patch.object(supervised_axes, "Axes", FreeAxes):
        block = bench.block(SupervisedAxes(spec))
    bench.within(**{"axes.clock": (0, slots - 1)})
    # An axis comes to a stage again a rota later, and not before.
    for stage in range(1, block.design.latency):
        valid, axis = (bench.inner[f"{name}_{stage}"] for name in ("valid", "axis"))
        bench.promise(~valid | (axis == (bench.inner["axes.clock"] - stage) % slots))
    return block


def turn_of(block: SupervisedAxes, axis: int) -> Value:
    """Return whether this is the clock after a turn of an axis."""
    return block.turn_valid & (block.turn_axis == axis)


def turn_at(bench: Bench, block: SupervisedAxes, axis: int, after: int) -> Value:
    """Return whether an axis is in the stage of so many clocks after its drive has changed."""
    stage = block.design.spec.latency + after
    return bench.inner[f"valid_{stage}"] & (bench.inner[f"axis_{stage}"] == axis)


def since_the_look(bench: Bench, block: SupervisedAxes, axis: int, name: str, happens: Value) -> Value:
    """Return whether something has happened since the axis's last look, or since a reset, and promise that it waits."""
    since = Signal()
    bench.m.d.sync += since.eq(happens | (since & ~turn_at(bench, block, axis, -LOOK)))
    bench.promise(bench.inner[f"waiting_{name}"][axis] == since)
    return since


def within_the_limit(bench: Bench) -> None:
    block = axes(bench)
    taken = bench.past(bench.inner["supervisor_force_limit"], LOOK + LET_OUT - 1)
    for axis, magnitude in enumerate(block.magnitude):
        before, now = Signal.like(taken), Signal.like(taken)
        bench.m.d.comb += now.eq(Mux(turn_of(block, axis), taken, before))
        bench.m.d.sync += before.eq(now)
        bench.promise(magnitude <= now)


def zero_when_a_loop_opens(bench: Bench) -> None:
    block = axes(bench)
    watches = bench.past(bench.inner["written_supervisor_causes"])
    for name in LOOPS:
        pins = getattr(block, name)
        first, level = (bench.inner[f"{name}_synchroniser.stage{stage}"] for stage in (0, 1))
        bench.promise((first == bench.past(pins)) & (level == bench.past(first)))
        opened = ~bench.past(pins, block.loop_latency)
        for axis, magnitude in enumerate(block.magnitude):
            acts = opened[axis] & watches[axis] if name == "external_fault" else opened[axis]
            bench.promise(~acts | (magnitude == 0) & ~block.armed[axis] & ~block.alive[axis])


def zero_but_armed(bench: Bench) -> None:
    block = axes(bench)
    goes = bench.inner["drives"]
    bench.promise(goes | (bench.inner["magnitude_now"] == 0))
    for axis, magnitude in enumerate(block.magnitude):
        bench.promise(block.armed[axis] | (magnitude == 0))
        bench.promise(block.armed[axis] | ~block.alive[axis])


def zero_after_a_look(bench: Bench) -> None:
    block, clocks = axes(bench), LOOK + LET_OUT
    for axis, magnitude in enumerate(block.magnitude):
        for name, wrong in (("illegal", block.illegal), ("overspeed", block.overspeed)):
            waited = bench.past(since_the_look(bench, block, axis, f"encoder_{name}", wrong[axis]), clocks)
            bench.promise(~(turn_of(block, axis) & waited) | (magnitude == 0) & (block.turn_state == TRIPPED))


def a_cause_in_a_turn_trips(bench: Bench) -> None:
    block = axes(bench)
    stood = bench.past(bench.inner["standing"], LET_OUT - 1)
    for axis, magnitude in enumerate(block.magnitude):
        tripped = (block.turn_state == TRIPPED) & (magnitude == 0) & ((stood & ~block.turn_latched) == 0)
        bench.promise(~(turn_of(block, axis) & stood.any()) | tripped)
    bench.promise(bench.inner["trips"] == bench.inner["standing"].any())


def armed_by_the_host_alone(bench: Bench) -> None:
    block, clocks = axes(bench), LOOK + LET_OUT
    before, live = bench.past(bench.inner["state_before"], LET_OUT - 1), bench.past(block.live, LET_OUT)
    levels = bench.inner["drive_enable_synchroniser.drive_enable_levels"]
    for axis, magnitude in enumerate(block.magnitude):
        asked = since_the_look(bench, block, axis, "arm", block.arm[axis])
        opened = since_the_look(bench, block, axis, "drive_enable", ~levels[axis])
        rose = turn_of(block, axis) & (block.turn_state == ARMED) & (before != ARMED)
        may = bench.past(asked & ~opened, clocks) & live & (before == DISARMED)
        bench.promise(~rose | may & (magnitude == 0))
        # Without a turn of its own an axis keeps its state, and without having been ARMED lets nothing out.
        state, turned = bench.inner[f"state_{axis}"], bench.past(turn_at(bench, block, axis, 1))
        bench.promise(turned | (state == bench.past(state)))
        bench.promise(~(turn_of(block, axis) & (before != ARMED)) | (magnitude == 0) & ~block.armed[axis])


def forgotten_by_acknowledgement_alone(bench: Bench) -> None:
    block = axes(bench)
    # The mask of the last acknowledgement of any axis, which makes void those that wait.
    mask = Signal.like(block.acknowledged)
    with bench.m.If(block.acknowledge.any()):
        bench.m.d.sync += mask.eq(block.acknowledged)
    bench.promise(bench.inner["acknowledged_last"] == mask)
    for axis in range(NUMBER):
        asked, latched = Signal(), bench.inner[f"latched_{axis}"]
        looked = turn_at(bench, block, axis, -LOOK)
        bench.m.d.sync += asked.eq(Mux(block.acknowledge.any(), block.acknowledge[axis], asked & ~looked))
        bench.promise(bench.inner["acknowledges"][axis] == asked)
        # What is latched changes a clock before the drive does.
        clocks, before = LOOK + LET_OUT - 1, bench.past(latched)
        told = bench.past(asked, clocks) & (bench.past(mask, clocks) == before)
        bench.promise(((before & ~latched) == 0) | told | bench.past(bench.inner["first_turn"]))


PROPERTIES = [
    Property(
        "the drive that leaves is within the force limit's word that its turn has taken",
        WHERE,
        within_the_limit,
        depth=7,
        bugs=(Bug(Supervisors._limited, "Mux(bound > most, most, bound)", "bound"),),
    ),
    Property(
        "drive and alive are zero three clocks after a loop's pin opens",
        WHERE,
        zero_when_a_loop_opens,
        depth=3,
        bugs=(
            Bug(Doors.__init__, '~levels["emergency_stop"]', '~levels["drive_enable"]'),
            Bug(Doors.let_out, ") & ~shut", ")"),
        ),
    ),
    Property(
        "drive and alive are zero in every axis that is not and stays ARMED",
        WHERE,
        zero_but_armed,
        depth=2,
        bugs=(Bug(Doors.let_out, "with m.If(shut)", "with m.If(shut & ~turn)"),),
    ),
    Property(
        "the drive is zero after the turn that looks after an encoder's fault, however short, and the axis TRIPPED",
        WHERE,
        zero_after_a_look,
        depth=8,
        bugs=(
            Bug(gathered.encoders, '"encoder_illegal": axes.illegal', '"encoder_illegal": axes.overspeed'),
            Bug(Pipe.waits, "pulses | (waiting & ~Cat(self.turns(stage)))", "pulses"),
        ),
    ),
    Property(
        "a cause that stands in a turn trips: the drive is zero after the turn, and the cause is latched",
        WHERE,
        a_cause_in_a_turn_trips,
        depth=6,
        bugs=(Bug(Supervisors._latched, '"latched_before") | standing', '"latched_before")'),),
    ),
    Property(
        "only the host's arm since the last look leads to ARMED, from DISARMED, with a closed loop and a live host",
        WHERE,
        armed_by_the_host_alone,
        depth=8,
        bugs=(Bug(Supervisors.judged, "(ready & stays & pipe.taken(turn.arm))", "(ready & stays)"),),
    ),
    Property(
        "a latched cause is forgotten only when exactly the latched ones are acknowledged, since the last look",
        WHERE,
        forgotten_by_acknowledgement_alone,
        depth=8,
        bugs=(Bug(Supervisors._latched, "(turn.acknowledged == before)", "(turn.acknowledged != 0)"),),
    ),
]
