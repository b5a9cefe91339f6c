"""A serial DAC: RTL against model at every clock, and frames against a DAC that reads the pins by itself."""

import cocotb
import pytest

from hardwall.hdl.drive.dac import Dac
from hardwall.model.drive import dac
from hardwall.model.drive.dac import Design, Inputs
from hardwall.model.drive.stage import Amplifier
from hardwall.testing import SAMPLES, Recorded, check, parameters, play, rng, simulate
from oracles.ad5761r import Ad5761r
from stimuli.lengths import some_of
from stimuli.stages import STAGES, axis, drives

NAMES = ["dac", "dac bare", "dac narrow", "dac high"]


def design(name: str) -> Design:
    return axis(name).drive


def make(name: str) -> Recorded:
    return Recorded(Dac(design(name)))


def campaign(name: str, clocks: int) -> dict:
    """Return columns of inputs: every kind of drive, and strobes as close as they may be, closer, and farther."""
    d, random = design(name), rng()
    columns = drives(d.magnitude.width, axis(name).force_limit_word, clocks, 4 * d.frame_clocks)
    columns["strobe"], at = 0 * columns["reset"], 0
    while at < clocks:
        columns["strobe"][at] = 1
        choices = d.frame_clocks, d.frame_clocks + 1, d.frame_clocks - 1, random.integers(1, 3 * d.frame_clocks)
        at += int(random.choice(choices, p=(0.5, 0.2, 0.1, 0.2)))
    return columns


def levels(name: str, columns) -> list[dict[str, int]]:
    """Return the pins after every edge for columns of inputs."""
    d, rows = design(name), []
    state = d.start
    seen = [list(columns(each)) for each in ("reset", "strobe", "magnitude", "negative", "armed", "permitted")]
    for reset, strobe, size, negative, armed, may in zip(*seen[:5], [*seen[5][1:], 0], strict=True):
        state = d.start if reset else dac.step(d.params, state, Inputs(strobe, size, negative, armed))
        rows.append(dac.pins(d, state, may))
    return rows


@cocotb.test()
async def follows_model(dut):
    name = parameters()["name"]
    inputs, outputs = await play(dut, make(name), campaign(name, SAMPLES))
    rows = levels(name, inputs.column)
    expected = {pin: [row[pin] for row in rows] for pin in Design.pins}
    check(inputs, outputs, expected)
    assert all(set(seen) == {0, 1} for seen in expected.values())


@pytest.mark.parametrize("name", some_of(NAMES, 0))
def test_rtl(name):
    simulate(__file__, make, name=name)


class Reader:
    """A DAC that knows its pins alone: it takes bits at the edges of its mode while it is selected, and a frame of the
    right length when the select rises.

    Attributes:
        code: the code of its output, two's complement; 0 after a clear.
        frames: the frames that it took.
        cut: the frames of another length, which it did not take.
    """

    def __init__(self, stage: dac.Stage):
        self.stage = stage
        self.takes = int(stage.mode in (0, 3))  # the level of the serial clock behind the edge at which a bit is taken
        self.code, self.frames, self.cut = 0, [], 0
        self._bits, self._clock, self._select = "", stage.mode >> 1, 1

    def see(self, dac_cs_n: int, dac_sclk: int, dac_mosi: int, dac_clear_n: int) -> None:
        """Look at the pins once a clock."""
        if not dac_cs_n and dac_sclk != self._clock and dac_sclk == self.takes:
            self._bits += str(dac_mosi)
        if dac_cs_n and not self._select:
            if len(self._bits) == self.stage.frame_bits:
                self._take(int(self._bits, 2))
            else:
                self.cut += 1
        if dac_cs_n:
            self._bits = ""
        self._clock, self._select = dac_sclk, dac_cs_n
        if not dac_clear_n:
            self.code = 0

    def _take(self, frame: int) -> None:
        self.frames.append(frame)
        if frame in self.stage.setup:
            return
        stage = self.stage
        assert frame >> stage.bits + stage.trailing_bits == stage.header
        assert frame & (1 << stage.trailing_bits) - 1 == 0
        code, half = frame >> stage.trailing_bits & (1 << stage.bits) - 1, 1 << stage.bits - 1
        self.code = code - half if stage.coding == "offset-binary" else (code ^ half) - half


def actuated(name: str, rows: list[tuple[int, int, int]], between: int) -> Reader:
    """Return the reader behind the drives (magnitude, sign, ARMED) of actuations, `between` clocks apart."""
    d, reader = design(name), Reader(STAGES[name][1])
    state = d.start
    for size, negative, armed in rows:
        for clock in range(between):
            state = dac.step(d.params, state, Inputs(int(clock == 0), size, negative, armed))
            reader.see(**dac.pins(d, state, 1))
    return reader


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("more", [0, 1, 7])
def test_the_dac_has_the_drive_as_volts_or_amperes(name, more):
    d, spec, stage = design(name), axis(name), STAGES[name][1]
    most, warm = spec.force_limit_word, [(0, 0, 1)] * (1 + len(stage.setup))
    for size in (0, 1, most // 3, most - 1, most):
        for negative in (0, 1):
            # The last actuation lets the one before it come to its end.
            row = (size, negative, 1)
            reader = actuated(name, [*warm, row, row, row], d.frame_clocks + more)
            output = reader.code / d.steps * stage.amplifier.full_scale
            newtons = (output - stage.amplifier.offset) * stage.amplifier.newtons_per_unit
            wanted = size * spec.force_resolution_n * (-1 if negative else 1)
            # Half a step and an eighth of the drive's rounding, half a step of the offset's, and the code that lacks
            # at the upper end.
            bound = 5 / 8 + (1 / 2 if stage.amplifier.offset else 0) + (reader.code == d.steps - 1)
            assert abs(newtons - wanted) <= d.step_n * bound + 1e-9
            assert reader.cut == 0
            assert tuple(reader.frames[: len(stage.setup)]) == stage.setup
            assert len(reader.frames) >= len(stage.setup) + 3


@pytest.mark.parametrize("name", NAMES)
def test_the_setup_goes_out_after_every_arming(name):
    stage, d = STAGES[name][1], design(name)
    told = [(5, 0, 1)] * (len(stage.setup) + 2)
    reader = actuated(name, [*told, (5, 0, 0), *told], d.frame_clocks + 3)
    assert [frame for frame in reader.frames if frame in stage.setup] == list(stage.setup) * 2


@pytest.mark.parametrize("name", NAMES)
def test_a_frame_that_safe_pins_end_is_not_taken_and_the_clear_holds(name):
    d, stage = design(name), STAGES[name][1]
    most, warm = d.magnitude.max // 2, 1 + len(stage.setup)
    for by in ("armed", "permitted"):
        for cut in range(1, d.frame_clocks - 1):
            reader, state = Reader(stage), d.start
            for clock in range((warm + 1) * d.frame_clocks + cut):
                state = dac.step(d.params, state, Inputs(int(clock % d.frame_clocks == 0), most, 0, 1))
                reader.see(**dac.pins(d, state, 1))
            assert reader.code > 0
            for _ in range(3 * d.frame_clocks):
                state = dac.step(d.params, state, Inputs(0, most, 0, int(by != "armed")))
                pins = dac.pins(d, state, int(by != "permitted"))
                reader.see(**pins)
                # One clock after the axis is not ARMED, or at once.
                assert pins["dac_clear_n"] == 0
                assert pins["dac_cs_n"] == 1
                assert reader.code == 0


@pytest.mark.parametrize("name", NAMES)
def test_the_code_is_there_when_the_latency_says(name):
    d, stage = design(name), STAGES[name][1]
    state, reader = d.start, Reader(stage)
    for clock in range((len(stage.setup) + 2) * d.frame_clocks):
        state = dac.step(d.params, state, Inputs(int(clock % d.frame_clocks == 0), 0, 0, 1))
    for clock in range(1, d.latency + 1):
        before = len(reader.frames)
        state = dac.step(d.params, state, Inputs(int(clock == 1), d.magnitude.max, 0, 1))
        reader.see(**dac.pins(d, state, 1))
    assert len(reader.frames) == before + 1
    assert reader.frames[-1] == dac.frame(d, min(d.offset + d.most, d.steps - 1))


def test_an_ad5761r_has_the_volts_of_the_drive_at_its_reset_pin_and_none_before_its_range_is_set():
    d, amplifier, chip = design("dac"), STAGES["dac"][1].amplifier, Ad5761r()
    state, most, between = d.start, d.magnitude.max // 2, d.frame_clocks
    for armed, size, negative in ((0, most, 0), (1, most, 0), (1, most, 1), (0, most, 0), (1, most // 3, 0), (1, 0, 0)):
        volts = []
        for clock in range((len(d.stage.setup) + 3) * between):
            state = dac.step(d.params, state, Inputs(int(clock % between == 0), size, negative, armed))
            chip.see(*dac.pins(d, state, 1).values())
            volts.append(chip.volts)
        wanted = armed * size * axis("dac").force_resolution_n / amplifier.newtons_per_unit * (-1 if negative else 1)
        assert abs(volts[-1] - wanted) <= d.step_n / amplifier.newtons_per_unit * 5 / 8 + 1e-9
        assert not chip.overrange
        # On the way there is nothing but the volts before, none, and those of the drive.
        assert set(volts[1:]) <= {volts[0], 0.0, volts[-1]}
        assert armed or set(volts[1:]) == {0.0}


def wrong(**fields) -> dac.Stage:
    return dac.Stage(**{"amplifier": STAGES["dac"][1].amplifier, "bits": 16, "serial_hz": 25_000_000} | fields)


@pytest.mark.parametrize(
    ("stage", "message"),
    [
        (wrong(bits=3), r"^stage.bits must be 4 to 24, not 3$"),
        (wrong(serial_hz=0), r"^stage.serial_hz must be 1 or more, not 0$"),
        (wrong(header_bits=2, header=4), r"^stage.header must be 0 to 3, not 4$"),
        (wrong(header_bits=17), r"^stage.header_bits must be 0 to 16, not 17$"),
        (wrong(trailing_bits=17), r"^stage.trailing_bits must be 0 to 16, not 17$"),
        (wrong(mode=4), r"^stage.mode must be 0 to 3, not 4$"),
        (wrong(coding="gray"), r"^stage.coding must be one of offset-binary, twos-complement, not 'gray'$"),
        (wrong(setup=[1]), r"^stage.setup must be a tuple of at most 8 frames, not \[1\]$"),
        (wrong(setup=(1 << 16,)), r"^stage.setup must be 0 to 65535, not 65536$"),
        (
            wrong(serial_hz=10_000_000),
            r"^actuation_hz must be at most 490196, for a frame of the DAC has 102 clocks, not 1000000$",
        ),
        (
            wrong(amplifier=Amplifier(unit="V", newtons_per_unit=4.0, full_scale=10.0, offset=1.0)),
            r"^force_max_n must be at most 35.9998 N, all that the drive stage gives, not 40.0$",
        ),
    ],
)
def test_stages_that_do_not_fit_are_refused(stage, message):
    with pytest.raises(ValueError, match=message):
        Design(axis("pdm"), stage)


def test_wrong_designs_are_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Dac(3)
    with pytest.raises(TypeError, match=r"^stage must be a dac.Stage, not 3$"):
        Design(axis("pdm"), 3)
