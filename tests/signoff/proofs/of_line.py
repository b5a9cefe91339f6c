"""What the serial line promises: no frame is accepted that is not good, nothing is lost unseen, nothing stays stuck."""

from amaranth.hdl import Const, Module, Mux, Signal, Value

from hardwall.hdl.link.line import Line
from hardwall.hdl.link.uart import Receiver, Transmitter
from hardwall.model.link import uart
from hardwall.model.link.line import BROADCAST, COUNTED, FIXED, FRAME_MAX, FRAME_MIN, UNIT, Verdict

from .bench import Bench
from .bugs import Bug
from .property import Property

GAP_CLOCKS = 3
"""The silence that ends a frame in these proofs; no rule of the line depends on how long it is."""
LINE = f"line gap of {GAP_CLOCKS} clocks"
SLOW = uart.Design(500_000, 115_200)
"""A divider with a little more than 4 clocks a bit, the fewest."""


def crc_of(m: Module, register: Value, byte: Value) -> Value:
    """Return the CRC of Modbus behind a byte, bit by bit, as the protocol's own text has it."""
    register = register ^ byte
    for _ in range(8):
        # Signals of its own for every bit: one expression of all of them would double with each.
        before, register = register, Signal(16)
        m.d.comb += register.eq(before >> 1 ^ Mux(before[0], 0xA001, 0))
    return register


class Heard:
    """What is known of the bytes that the line has taken since the last frame was dealt with, beside the line.

    Attributes:
        taken: the line takes a byte at this clock.
        crc, count, unit, function, spoilt: of the bytes so far.
        length: the length of the frame, once `counted`: by its function, or by its byte count.
        unlimited: the function has no length.
    """

    def __init__(self, bench: Bench, line: Line):
        m: Module = bench.m
        self.taken = line.arrived & bench.inner["listening"] & ~bench.inner["draining"]
        self.crc, self.count = Signal(16), Signal(range(FRAME_MAX + 1))
        self.unit, self.function, self.spoilt = Signal(8), Signal(8), Signal()
        self.length, self.counted = Signal(range(2 * FRAME_MAX)), Signal()
        with m.If(self.taken):
            m.d.sync += [
                self.crc.eq(crc_of(m, Mux(self.count == 0, 0xFFFF, self.crc), line.byte)),
                self.count.eq(self.count + 1),
                self.spoilt.eq(line.spoilt | self.spoilt),
            ]
            with m.If(self.count == 0):
                m.d.sync += [self.unit.eq(line.byte), self.spoilt.eq(line.spoilt), self.counted.eq(0)]
            with m.If(self.count == 1):
                m.d.sync += self.function.eq(line.byte)
                for function, length in FIXED.items():
                    with m.If(line.byte == function):
                        m.d.sync += [self.length.eq(length), self.counted.eq(1)]
            for function, place in COUNTED.items():
                with m.If((self.count == place) & (self.function == function)):
                    m.d.sync += [self.length.eq(place + 1 + line.byte + 2), self.counted.eq(1)]
        with m.Elif(line.frames.ended & line.frames.finished):
            m.d.sync += self.count.eq(0)
        self.unlimited = Const(1)
        for function in (*FIXED, *COUNTED):
            self.unlimited &= self.function != function


def line_and_heard(bench: Bench) -> tuple[Line, Heard]:
    """Return a line and what it has heard, and promise that its registers agree with that."""
    line = bench.block(Line(GAP_CLOCKS))
    inner, heard = bench.inner, Heard(bench, line)
    listening, judging, ended = (bench.state(name) for name in ("LISTEN", "JUDGE", "ENDED"))
    begun, known = heard.count != 0, inner["known"]
    bench.promise(~(listening | judging) | (inner["position"] == heard.count[:8]))
    bench.promise(listening | judging | (inner["position"] == 0) & ~known & ~inner["spoilt"])
    bench.promise(~listening | (heard.count < FRAME_MAX) & (begun | ~known & ~inner["spoilt"]))
    bench.promise(listening | judging | ended | ~begun)
    bench.promise(~judging | begun)
    bench.promise(~listening | ~inner["draining"] | ~begun)
    under_way = begun & (listening | judging)
    unit = Mux(heard.unit == UNIT, Verdict.REQUEST, Mux(heard.unit == BROADCAST, Verdict.BROADCAST, Verdict.FOREIGN))
    bench.promise(~under_way | (inner["crc.crc"] == heard.crc))
    bench.promise(~under_way | (inner["addressed"] == unit) & (inner["spoilt"] == heard.spoilt))
    bench.promise(~under_way | (heard.count == 1) | (line.frames.function == heard.function))
    bench.promise(~under_way | (known == heard.counted) & (~known | (inner["last"] + 1 == heard.length)))
    bench.promise(~under_way | ~heard.counted | ~heard.unlimited & (heard.count > 1))
    for function, place in COUNTED.items():
        counted = heard.counted == (heard.count > place)
        bench.promise(~under_way | (heard.function != function) | (heard.count == 1) | counted)
    return line, heard


def accepted(line: Line) -> Value:
    """Return whether a frame with a good verdict is handed on."""
    verdict = line.frames.verdict
    return line.frames.ended & (verdict != Verdict.SPOILT) & (verdict != Verdict.OVERRUN)


def never_a_bad_crc(bench: Bench) -> None:
    line, heard = line_and_heard(bench)
    bench.promise(~accepted(line) | (heard.count != 0) & (heard.crc == 0))


def whole_and_unspoilt(bench: Bench) -> None:
    line, heard = line_and_heard(bench)
    whole = heard.counted & (heard.count == heard.length)
    by_a_gap = heard.unlimited & (heard.count >= FRAME_MIN)
    good, verdict = bench.inner["good"], line.frames.verdict
    bench.promise(~(bench.state("JUDGE") & good) | whole | by_a_gap)
    bench.promise(~accepted(line) | (whole | by_a_gap) & ~heard.spoilt)
    bench.promise(~accepted(line) | (line.frames.function == heard.function))
    bench.promise(~accepted(line) | ((verdict == Verdict.REQUEST) == (heard.unit == UNIT)))
    bench.promise(~accepted(line) | ((verdict == Verdict.BROADCAST) == (heard.unit == BROADCAST)))


def keeps_the_frame(bench: Bench) -> None:
    frames = bench.block(Line(GAP_CLOCKS)).frames
    bench.promise(bench.kept((frames.ended, frames.verdict, frames.function), frames.ended & ~frames.finished))


def no_byte_is_dropped_unseen(bench: Bench) -> None:
    line = bench.block(Line(GAP_CLOCKS))
    told, missed = line.frames.ended & (line.frames.verdict == Verdict.OVERRUN), Signal()
    dropped = line.arrived & ~bench.inner["listening"] & ~bench.inner["draining"]
    bench.m.d.sync += missed.eq((missed & ~told) | dropped)
    bench.promise(~missed | bench.inner["overrun"] | told)
    bench.promise(~bench.inner["listening"] | ~missed)
    # What is dropped otherwise follows a frame whose verdict says so, and no good frame since.
    says_so = (line.frames.verdict == Verdict.SPOILT) | (line.frames.verdict == Verdict.OVERRUN)
    bench.promise(~bench.inner["draining"] | says_so)
    judging, hearing = bench.state("JUDGE"), bench.inner["listening"] & ~bench.inner["draining"]
    bench.promise(~judging | ~bench.inner["draining"])
    bench.promise(hearing | judging | (bench.inner["position"] == 0))


def listens_after_a_gap(bench: Bench) -> None:
    line = bench.block(Line(GAP_CLOCKS))
    inner, frames = bench.inner, line.frames
    judging, listening, overrun = bench.state("JUDGE"), inner["listening"], inner["overrun"]
    draining, gap = inner["draining"], Signal(range(GAP_CLOCKS + 1))
    bench.m.d.comb += gap.eq(GAP_CLOCKS - inner["quiet"])
    bench.promise(inner["quiet"] <= GAP_CLOCKS)
    bench.promise(~listening | ~overrun)
    bench.promise(~judging | ~draining)
    bench.promise(listening & ~draining | judging | (inner["position"] == 0))
    # The states to come, those of another verdict for bytes that were dropped, and a gap if bytes are to be dropped.
    to_come = [(name, clocks) for clocks, name in enumerate(("OVER", "CRC_HIGH", "CRC_LOW", "ENDED", "JUDGE"), 1)]
    drains = draining | overrun | judging & (gap != 0)
    left = Mux(drains, gap + 1, 0) + Mux(overrun, 2, 0)
    for name, clocks in to_come:
        left = left + Mux(bench.state(name), clocks, 0)
    # Only an answer is followed by a CRC.
    left = left - Mux(bench.state("ENDED") & (frames.verdict != Verdict.REQUEST), 2, 0)
    left = Mux(listening & (inner["position"] != 0), gap + 1 + len(to_come), left)
    bench.falls(
        left,
        most=GAP_CLOCKS + 1 + 2 + len(to_come),
        free=listening & ~draining & (inner["position"] == 0),
        waits=frames.ended & ~frames.finished | bench.state("CRC_LOW", "CRC_HIGH") & ~line.sent.ready,
        begins=line.arrived,
    )


def receiver_waits_for_a_start(bench: Bench) -> None:
    receiver = bench.block(Receiver(SLOW))
    inner, bit = bench.inner, SLOW.bit[0] + 1
    bench.promise(~inner["busy"] | (inner["bits"] < uart.FRAME_BITS))
    bench.within(left=(0, SLOW.bit[0]))
    seen = bench.past(receiver.pin, init=1)
    bench.promise((inner["synchroniser.stage0"] == seen) & (inner["synchroniser.stage1"] == bench.past(seen, init=1)))
    bench.falls(
        Mux(inner["busy"], inner["left"] + 1 + (uart.FRAME_BITS - 1 - inner["bits"]) * bit, 0),
        most=uart.FRAME_BITS * bit,
        free=~inner["busy"],
        # A fall of the line begins a byte behind the synchroniser.
        begins=~bench.past(seen, init=1),
    )


def transmitter_gets_ready(bench: Bench) -> None:
    transmitter = bench.block(Transmitter(SLOW))
    inner, bit = bench.inner, SLOW.bit[0] + 1
    bench.within(left=(0, SLOW.bit[0]), bits=(0, uart.FRAME_BITS))
    bench.falls(
        Mux(inner["bits"] == 0, 0, inner["left"] + 1 + (inner["bits"] - 1)[:4] * bit),
        most=uart.FRAME_BITS * bit,
        free=transmitter.bytes.ready,
        begins=transmitter.bytes.ready & transmitter.bytes.valid,
    )


PROPERTIES = [
    Property(
        "a frame is accepted only if the CRC over all of its bytes is right",
        LINE,
        never_a_bad_crc,
        depth=2,
        bugs=(
            Bug(Line.elaborate, "& ~spoilt & check.match_detected", "& ~spoilt"),
            Bug(Line.elaborate, "check.start.eq(position == 0)", "check.start.eq(position[:2] == 0)"),
        ),
        quick=True,
    ),
    Property(
        "a frame is accepted only with the length of its function, without a spoilt byte, and with its own unit",
        LINE,
        whole_and_unspoilt,
        depth=2,
        bugs=(
            Bug(Line.elaborate, "spoilt.eq(spoilt | self.spoilt)", "spoilt.eq(self.spoilt)"),
            Bug(Line.elaborate, "(position >= FRAME_MIN)", "(position != 0)"),
            Bug(Line.elaborate, "self.byte == BROADCAST", "~self.byte[0]"),
        ),
    ),
    Property(
        "a frame that has ended keeps its verdict and its function until it is finished",
        LINE,
        keeps_the_frame,
        depth=2,
        bugs=(Bug(Line.elaborate, "m.If(frames.finished)", "m.If(frames.finished | lost)"),),
    ),
    Property(
        "a byte is dropped only with the verdict OVERRUN, or before the gap behind a frame with it or with SPOILT",
        LINE,
        no_byte_is_dropped_unseen,
        depth=2,
        bugs=(
            Bug(Line.elaborate, "m.If(lost)", "m.If(overrun)"),
            Bug(Line.elaborate, "+= frames.verdict.eq(addressed)", "+= [frames.verdict.eq(addressed), draining.eq(1)]"),
        ),
    ),
    Property(
        "the line listens again within a gap and 8 clocks without a byte in which no one else is waited for",
        LINE,
        listens_after_a_gap,
        depth=2,
        bugs=(
            Bug(Line.elaborate, "m.d.sync += draining.eq(0)", "m.d.sync += draining.eq(draining)"),
            Bug(Line.elaborate, "overrun.eq(0), draining.eq(1)", "draining.eq(1)"),
        ),
        quick=True,
    ),
    Property(
        "the receiver waits for the next start bit within 10 bits of an idle line",
        "uart 500 kHz",
        receiver_waits_for_a_start,
        depth=2,
        bugs=(Bug(Receiver.elaborate, "bits == FRAME_BITS - 1", "bits == FRAME_BITS"),),
        within=60,
    ),
    Property(
        "the transmitter is ready within 10 bits of taking a byte",
        "uart 500 kHz",
        transmitter_gets_ready,
        depth=2,
        bugs=(Bug(Transmitter.elaborate, "bits.eq(bits - 1)", "bits.eq(bits)"),),
    ),
]
