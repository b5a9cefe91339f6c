"""The channels of a capture: by name, by number, or the only two; and rates in words."""

import pytest

from hardwall.sim.recordings.capture import Capture, hertz_of
from hardwall.sim.recordings.error import RecordingError


class Made(Capture):
    name, form = "made.sr", "made"

    def __init__(self, *channels):
        self.channels = list(channels)

    def changes(self, places):
        raise NotImplementedError


@pytest.mark.parametrize(
    ("channels", "wanted", "places"),
    [
        (["B", "A"], (), [1, 0]),
        (["enc_a", "enc_b", "enc_z"], (), [0, 1, 2]),
        (["Index", "A", "B", "CLK"], (), [1, 2, 0]),
        (["0", "1"], (), [0, 1]),
        (["D0", "D1", "D2"], ("D2", "D0"), [2, 0]),
        (["D0", "D1", "D2"], ("3", "1", "2"), [2, 0, 1]),
        (["2", "1"], ("1", "2"), [1, 0]),
    ],
)
def test_channels_are_found(channels, wanted, places):
    assert Made(*channels).places(wanted) == places


@pytest.mark.parametrize(
    ("channels", "wanted", "said"),
    [
        (["D0", "D1", "D2"], (), "the channels A and B must be given (--channels A,B), two or with Z three of D0, D1"),
        (["A", "B", "left_A"], (), "the channels A and B must be given"),
        (["D0", "D1"], ("D0", "D7"), "a channel must be one of D0, D1, or a number of 1 to 2, not 'D7'"),
        (["D0", "D1"], ("3", "1"), "or a number of 1 to 2, not '3'"),
    ],
)
def test_channels_in_doubt_are_asked_for(channels, wanted, said):
    with pytest.raises(RecordingError) as error:
        Made(*channels).places(wanted)
    assert str(error.value).startswith("made.sr: ")
    assert said in str(error.value)


@pytest.mark.parametrize(
    ("text", "rate"),
    [
        ("1 MHz", 1e6),
        ("12.5 kHz", 12.5e3),
        ("200000", 2e5),
        ("24MHz", 24e6),
        ("fast", None),
        ("0", None),
        ("1.2.3", None),
        ("999 GHz", 999e9),
        ("1000 GHz", None),
        ("1e-3", 1e-3),
    ],
)
def test_rates_in_words(text, rate):
    assert hertz_of(text) == rate
