"""Several axes that may drive motors: the axes, with monitors and supervisors that take turns as the axes do."""

from amaranth.hdl import Cat, Const, Module, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.data import ArrayLayout
from amaranth.lib.wiring import In, Out

from hardwall.model.axes.axis import FRONT_LATENCY, AxesSpec
from hardwall.model.axes.supervised import LOOK, SAMPLE_WORDS, Design
from hardwall.model.axis.monitors import BITS
from hardwall.model.axis.supervised import FIXED, SLIPS
from hardwall.model.axis.supervisor import CAUSES, COUNT, COUNT_BITS

from ..arithmetic.fixed import less, shape
from ..axis.supervised import COMPLEMENTS, LOOPS
from ..axis.watchdog import Watchdog
from ..wires import ports
from . import pending_pulses as gathered
from .axis import Axes
from .live_words import LiveWords, Writing
from .monitors import Looked, Monitors
from .output_gates import Doors
from .pipe import Pipe
from .supervisor import Judged, Supervisors, Turn

REQUESTS = "arm", "disarm", "acknowledge"
"""Pulses of the host that wait for an axis's turn."""
HIDDEN = "drive", "sampled", "actuated"
"""Internal outputs of the axes: the drive before its supervisor, and the signal of its change."""


class SupervisedAxes(wiring.Component):
    """Axes from encoder pins to drives that are let out: `Axes`, and `Monitors` and `Supervisors` in the same rota.

    Every axis has its own supervisor, with the promises of `hardwall.hdl.axis.supervisor.Supervisor`. It acts in the
    axis's turn, once a sample: what pins, host and decoder did since the last turn waits for it, and so do pulses of
    the host. A turn looks `LOOK` clocks before the sample's drive is there. It decides a clock after the drive, with
    the monitors' causes of that very sample. So the drive of a faulty sample is never let out.

    Between the turns, zero is as near as for a single axis. A loop that opens makes the drive zero at the third clock
    edge. It stays zero until the turn, which then finds the axis not ARMED. The loop of `external_fault` does so where
    `supervisor_causes` has its bit, as the host wrote it last.

    Bit i of an input with one bit for each axis belongs to axis i. Element i of an output array is the word of axis i.

    Parameters at run time are written as in `Axes`, by the numbers of `design.words`. The words of `spec.design.words`
    wait for a `commit`. The others act in the axis's next turn, so a lower force limit holds with its drive.
    `output_force_limit` cannot be written. A commit of another `encoder_invert` is a `disarm` and a `slip`. A turn that
    finds a watched cause of `SLIPS` is a `slip`, too. All axes share the host's heartbeat and its watchdog. A word of
    the watchdog beyond its range is the cause word_range of every axis. Both, and the ranges of the words, are looked
    at in the turn alone: what lasts for less than a rota is missed.

    Causes: as in `hardwall.model.axis.supervisor`, as far as `hardwall.model.axes.monitors` sees them. strobe_busy is
        never
    present: the rota has a clock for every axis, and nothing can begin in it sooner.

    Latency: `latency` clocks from a strobe to the changed drive that is let out, 3 more than `Axes`. From the pin of an
    opening loop to a drive of zero: `loop_latency` clock edges; the first one sees the pin. From a fault of the
    decoder, a word or the host to a drive of zero `trip_latency` clock edges at most: a rota, and the clocks of a turn.

    An acknowledgement within a rota of another one takes its place: the other is void. A preload, or a shift of the
    origin, of an axis that is ARMED moves the count under its wall: whoever speaks for the host has to refuse it. The
    `preload_count` of a shift stays until the next turn of the axis, when the place of its last index moves.

    Rounding and overflow: as in the blocks.

    Parameters
    ----------
    spec : hardwall.model.axes.axis.AxesSpec
        Rates, ranges, the number of axes and the estimator.

    Members
    -------
    the pins, pulses and outputs of `Axes` : In and Out As there, except `drive` and the signal of its change:
        `record_drive` is the drive from the output stage.
    encoder_a_n, encoder_b_n : In(axes)
        Complements of the encoders' channels; asynchronous. They count for nothing unless encoder_loss is enabled.
    drive_enable, external_fault, emergency_stop : In(axes)
        Loops: high is closed; asynchronous.
    arm, disarm, acknowledge : In(axes), acknowledged : In
        Pulses of the host, and the causes that it has read, with `acknowledge`.
    heartbeat, supervisor_watchdog : In
        As of `Watchdog`.
    magnitude : Out(array), negative : Out(axes)
        The drive that may leave the FPGA, force LSB.
    armed, alive, drive_inverted : Out(axes)
        ARMED since the last turn, and nothing has stopped it; a square wave while it is; the others as of a
        `SupervisedAxis`.
    live : Out(1)
        The host's heartbeat is not overdue.
    turn_valid : Out(1)
        High for one clock, with the changed drive of every turn of any axis.
    turn_axis, turn_state, turn_ready, turn_latched, turn_first : Out
    turn_first_stamp, turn_counts, turn_a_channel_idle : Out
        With `turn_valid`: the axis, and what its supervisor and its monitors show after the turn. `first_stamp` is the
        number of the clock in which the turn decided.

    Raises
    ------
    TypeError
        If `spec` is not an AxesSpec.
    """

    def __init__(self, spec: AxesSpec):
        self._axes = Axes(spec)
        self._design = design = Design(spec)
        self._watchdog = Watchdog(design.watchdog)
        axes = spec.axes
        shown = {
            "axis": range(max(axes, 2)),
            "state": 2,
            "ready": 1,
            "latched": COUNT,
            "first": COUNT,
            "first_stamp": spec.stamp_width,
            "counts": COUNT * COUNT_BITS,
            "a_channel_idle": 1,
        }
        watchdog = self._watchdog.signature.members
        super().__init__(
            {
                **{name: member for name, member in self._axes.signature.members.items() if name not in HIDDEN},
                "word_number": In(range(len(design.words))),
                "word_value": In(max(word.format.width for word in design.words)),
                **dict.fromkeys((*COMPLEMENTS, *LOOPS, *REQUESTS), In(axes)),
                "acknowledged": In(COUNT),
                **{name: watchdog[name] for name in ("heartbeat", "supervisor_watchdog", "live")},
                "magnitude": Out(ArrayLayout(shape(design.supervisor.limit), axes)),
                **dict.fromkeys(("negative", "armed", "alive", "drive_inverted"), Out(axes)),
                "turn_valid": Out(1),
                **{f"turn_{name}": Out(each) for name, each in shown.items()},
            }
        )

    @property
    def design(self) -> Design:
        return self._design

    @property
    def latency(self) -> int:
        """Clocks from the strobe of an axis to the changed drive that is let out."""
        return self._design.latency

    @property
    def loop_latency(self) -> int:
        """Clock edges from the first that sees a loop open to the zeroing of the drive, both included."""
        return 3

    @property
    def trip_latency(self) -> int:
        """The most clock edges from what is wrong, or a host's disarm, to a drive of zero."""
        return self._design.trip_clocks

    def elaborate(self, platform):
        m = Module()
        design, axes = self._design, self._axes
        m.submodules.axes, m.submodules.watchdog = axes, self._watchdog
        pipe, first = Pipe(m, axes.spec.axes, axes.strobe_axis, axes.strobe), ~axes.word_ready
        end, sampled = axes.spec.latency, FRONT_LATENCY + axes.spec.pipeline.latency
        look = end - LOOK
        levels = self._levels(m)
        self._connect(m, levels["drive_enable"])

        writing = Writing(self.word_axis, self.word_number, self.word_value, self.word_write & axes.word_ready)
        words = LiveWords(pipe, first, design.words, writing)
        for word in design.live:
            words.add(word, sampled - 1 if word.name in SAMPLE_WORDS else look)

        doors = Doors(pipe, levels, words.written("supervisor_causes", BITS["external_fault"]), look)
        turned = gathered.turned(m, words.written("encoder_invert", 0), axes.commit_pending)
        asked = gathered.Asked(self.arm, self.disarm | turned, self.acknowledge, self.acknowledged)
        waiting = {**doors.waiting, **gathered.encoders(pipe, axes, levels, look), "referenced": axes.referenced}
        waited = gathered.looked_at(pipe, waiting, asked, look)
        monitors, supervisors = Monitors(pipe, design, words), Supervisors(pipe, design.supervisor, words)
        sample = gathered.sample(pipe, axes, first, design.index_bits, sampled)
        moved = pipe.later(monitors.moved(sample), look - sampled - 2)
        lost, idle = monitors.of_look(
            Looked(
                look + 1,
                pipe.later(first, look + 1),
                lost=Cat(~waited["unlike_a"], ~waited["unlike_b"]),
                edges=Cat(waited["edge_a"], waited["edge_b"]),
            )
        )
        outside = {bit: pipe.taken(waited[cause.name]) for bit, cause in enumerate(CAUSES) if cause.name in waited}
        outside[BITS["word_range"]] = pipe.taken(self._out_of_range(words, look + 1))
        made = {
            **monitors.of_sample(sample, end),
            **monitors.runaway(moved, pipe.later(first, look), supervisors.let_out, look - 1),
            **lost,
        }
        slips = Cat(made[bit] & words("supervisor_causes", end)[bit] for bit in SLIPS).any()
        found = Cat(pipe.turns(end + 1)) & pipe.taken(slips, "slips").replicate(axes.spec.axes)
        m.d.comb += axes.slip.eq(self.slip | turned | found)
        judged = supervisors.judged(
            Turn(
                stage=end,
                drive=axes.record_drive,
                stamp=axes.stamp,
                first=pipe.later(first, end),
                live=self._watchdog.live,
                causes=Cat(outside.get(bit, Const(0, 1)) | made.get(bit, Const(0, 1)) for bit in range(COUNT)),
                enable=~pipe.taken(waited["drive_enable"]),
                **{name: pipe.taken(waited[name]) for name in ("referenced", *REQUESTS, "acknowledged")},
            )
        )
        doors.let_out(judged, self._watchdog.wave, words("drive_invert", end + 2), end + 2)
        m.d.comb += [
            self.magnitude.eq(doors.magnitude),
            self.negative.eq(doors.negative),
            self.armed.eq(doors.armed),
            self.alive.eq(doors.alive),
            self.drive_inverted.eq(doors.drive_inverted),
        ]
        self._show(pipe, judged, pipe.later(idle, 2), end + 2)
        return m

    def _levels(self, m: Module) -> dict[str, Signal]:
        """Return the levels of pins as the same edge of the clock has seen them, a bit for each axis."""
        levels = {}
        for name, pins in ports(self, ("encoder_a", "encoder_b", *COMPLEMENTS, *LOOPS)).items():
            levels[name] = Signal(self._axes.spec.axes, name=f"{name}_levels")
            m.submodules[f"{name}_synchroniser"] = FFSynchronizer(pins, levels[name])
        return levels

    def _connect(self, m: Module, enable: Value) -> None:
        """Connect the axes. Their own enable follows the loop, so that their slew limit begins at zero, too."""
        axes, watchdog = self._axes, self._watchdog
        known = self._design.spec.design.words
        fixed = [number for number, word in enumerate(known) if word.name in FIXED]
        theirs = (self.word_number < len(known)) & ~Cat(self.word_number == number for number in fixed).any()
        ours, members = ports(self), axes.signature.members
        for name, its in ports(axes).items():
            if members[name].flow == Out and name not in HIDDEN:
                m.d.comb += ours[name].eq(its)
            elif members[name].flow == In and name not in ("drive_enable", "word_write", "slip"):
                m.d.comb += its.eq(Value.cast(ours[name])[: len(Value.cast(its))])
        m.d.comb += [
            axes.drive_enable.eq(enable),
            axes.word_write.eq(self.word_write & theirs),
            watchdog.heartbeat.eq(self.heartbeat),
            watchdog.supervisor_watchdog.eq(self.supervisor_watchdog),
            self.live.eq(watchdog.live),
        ]

    def _out_of_range(self, words: LiveWords, stage: int) -> Value:
        """Return whether a word of the axis that is in a stage, or the watchdog's, is beyond its range."""
        beyond = []
        for name, (least, most) in self._design.ranges.items():
            word = self.supervisor_watchdog if name == "supervisor_watchdog" else words(name, stage)
            beyond += [less(word, least), ~less(word, most + 1)]
        return Cat(beyond).any()

    def _show(self, pipe: Pipe, judged: Judged, idle: Value, stage: int) -> None:
        """Show a turn of that stage."""
        pipe.m.d.sync += [
            self.turn_valid.eq(pipe.valid(stage)),
            self.turn_axis.eq(pipe.axis(stage)),
            self.turn_a_channel_idle.eq(idle),
            self.turn_state.eq(judged.state),
            self.turn_ready.eq(judged.ready),
            self.turn_latched.eq(judged.latched),
            self.turn_first.eq(judged.first),
            self.turn_first_stamp.eq(judged.first_stamp),
            self.turn_counts.eq(judged.counts),
        ]
