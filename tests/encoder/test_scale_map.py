"""The map of the scale: RTL against model at every clock, and the model against what the bins are."""

import cocotb
import numpy as np
import pytest

from hardwall.hdl.encoder.scale_map import ScaleMap
from hardwall.model.arithmetic.fixed import wrap
from hardwall.model.encoder import scale_map
from hardwall.model.encoder.scale_map import Design, place_of
from hardwall.testing import Recorded, check, parameters, play, simulate
from stimuli.lengths import some_of
from stimuli.seeded import seeded

CLOCKS = 6000
"""Clocks of a campaign, beside one for each bin."""
SIZES = [(12, -300, 3, 77, 16.0), (20, -65536, 4, 8192, 10.0), (8, -128, 0, 256, 1.0)]
"""Bins in the middle of the count, of a long scale, and all of a small count: width, first, bin_bits, bins, limit."""


def make(size: tuple) -> Recorded:
    return Recorded(ScaleMap(Design(*size)))


def stimulus(d: Design) -> dict[str, np.ndarray]:
    """Return the inputs at every clock: words into every bin first, then edges around every end, and more words."""
    random = seeded()
    half, last = 1 << (d.count_width - 1), d.first + (d.bins << d.bin_bits)
    ends = [-half, half - 1, d.first, d.first - 1, d.first + (1 << d.bin_bits), last, last - 1, 0]
    rows = []
    for k in range(d.bins + CLOCKS):
        number = random.choice(ends) if random.random() < 0.3 else random.randint(d.first - 99, last + 99)
        rows.append(
            {
                "reset": int(random.random() < 0.001),
                "number": min(max(number, -half), half - 1),
                "enabled": int(random.random() < 0.99),
                "shift": int(random.random() < 0.02),
                "shift_count": random.choice(
                    [-half, half - 1, random.randint(-99, 99), random.randint(-half, half - 1)]
                ),
                "write": int(k < d.bins or random.random() < 0.1),
                "bin": k if k < d.bins else random.choice([0, d.bins - 1, random.randrange(d.bins)]),
                "written": random.choice([d.place.min, d.place.max, random.randint(d.place.min, d.place.max)]),
            }
        )
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


@cocotb.test()
async def follows_model(dut):
    recorded = make(**parameters())
    d = recorded.component.design
    inputs, outputs = await play(dut, recorded, stimulus(d))
    places = np.zeros(d.bins, np.int64)
    params = scale_map.Params(d.first, d.bin_bits, places)
    expected, met, beyond = {"error": [], "outside": []}, 0, 0
    ahead, origin = None, 0
    for row in inputs.rows:
        given = dict(zip(inputs.names, row, strict=True))
        # The memory is read with the number of a clock before, as it is before this clock's word.
        error = 0 if ahead is None else places[ahead]
        expected["error"].append(int(error))
        expected["outside"].append(0 if given["reset"] else beyond)
        number = scale_map.unshifted(given["number"], origin, d.count_width)
        held = min(max(scale_map.bin_of(params, number), 0), d.bins - 1)
        ahead = 0 if given["reset"] else held
        beyond = 0 if given["reset"] else place_of(params, number).outside
        shift = given["shift"] * given["shift_count"]
        origin = wrap(origin + shift, d.count_width) if given["enabled"] and not given["reset"] else 0
        if given["write"]:
            places[given["bin"]] = given["written"]
        met += error != 0
    # The gate acts at once, on what the next clock shows.
    gates = [*inputs.column("enabled")[1:], 0]
    expected["error"] = [error if gate else 0 for error, gate in zip(expected["error"], gates, strict=True)]
    check(inputs, outputs, expected)
    assert met > CLOCKS // 4
    assert set(expected["outside"]) == ({0} if d.bins << d.bin_bits == 1 << d.count_width else {0, 1})


@pytest.mark.parametrize("size", some_of(SIZES, 0))
def test_rtl(size):
    simulate(__file__, make, size=size)


def test_an_edge_has_the_error_of_its_bin_and_beyond_the_bins_that_of_the_nearest():
    d = Design(10, -20, 2, 10)
    params = d.params(np.arange(10) - 3.0)
    for number in range(-512, 512):
        counted = (number + 20) // 4
        place = place_of(params, number)
        assert place == (64 * (min(max(counted, 0), 9) - 3), int(not 0 <= counted <= 9))


@pytest.mark.parametrize("origin", [-512, -300, 7, 511])
def test_an_edge_keeps_its_bin_when_the_origin_is_shifted(origin):
    d = Design(10, -20, 2, 10)
    params = d.params(np.arange(10) - 3.0)
    for number in range(-512, 512):
        shifted = wrap(number + origin, 10)
        assert place_of(params, scale_map.unshifted(shifted, origin, 10)) == place_of(params, number)


def test_words_are_rounded_half_up_and_saturate():
    d = Design(10, 0, 0, 5, 2.0)
    assert (d.place.width, d.bits) == (9, 45)
    lsb = 1 / 64
    assert d.words([0.5 * lsb, -0.5 * lsb, 2.0, 1e9, -1e9]).tolist() == [1, 0, 128, 255, -255]
    assert d.params([0.1, 0, 0, 0, 9.0], floating=True).places.tolist() == [0.1, 0, 0, 0, 9.0]


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ((10, 0, 0, 513), ValueError, "bins must be at most 512 from edge 0 on, not 513"),
        ((10, 600, 0, 4), ValueError, "first must be -512 to 511, not 600"),
        ((10, 0, 0, 1), ValueError, "bins must be 2 to 1048576, not 1"),
        ((10, 0, 0.5, 4), TypeError, "bin_bits must be an int, not 0.5"),
        ((10, 0, 0, 4, 0.0), ValueError, "limit_counts must be 0.015625 to 10000, not 0.0"),
    ],
)
def test_bins_that_cannot_be_are_refused(arguments, error, message):
    with pytest.raises(error) as raised:
        Design(*arguments)
    assert str(raised.value) == message


@pytest.mark.parametrize("errors", [[0.0] * 4, [0.0] * 4 + [np.nan]])
def test_errors_that_are_no_map_are_refused(errors):
    with pytest.raises(ValueError, match="errors must be 5 finite numbers"):
        Design(10, 0, 0, 5).words(errors)
