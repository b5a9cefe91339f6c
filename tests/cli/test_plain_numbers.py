"""Numbers on the command line: decimal ones, by one rule for every option, word and key of a scene."""

import pytest

from hardwall.cli import scenes
from hardwall.cli.errors import BadInput
from hardwall.cli.options import numbers_of
from hardwall.cli.plain_numbers import plain_number
from hardwall.cli.set import values_of
from support.command_line import call

NOT_PLAIN = ("1_0", "1_0.5", "0x10", "0b1", "0o7", "1e1_0", "\u0661", "\uff11", "")


@pytest.mark.parametrize("text", NOT_PLAIN)
def test_what_only_a_program_takes_for_a_number_is_none(text):
    with pytest.raises(ValueError, match=r"^must be a decimal number such as 0\.5 or 5e-4, not "):
        plain_number(text)
    with pytest.raises(BadInput, match=r"'wall_stiffness' must be a decimal number such as 0\.5 or 5e-4, not "):
        values_of([f"wall_stiffness={text}"])
    with pytest.raises(BadInput, match=r"--rates must be numbers of 1 to 100 Hz, not "):
        numbers_of(text, "--rates", 1, 100, "Hz")


@pytest.mark.parametrize(("text", "value"), [("10", 10), ("-.5", -0.5), ("2.", 2), ("+5E-4", 5e-4), (" 7", 7)])
def test_a_decimal_number_is_one_everywhere(text, value):
    assert plain_number(text) == values_of([f"w={text}"])["w"] == value
    assert scenes.value_of("handle.mass_kg", text) == value


@pytest.mark.parametrize("text", ["1_0", "0x10", "1_0.5", "[1, 2_0]", "1e1_0", "+1_0"])
def test_a_key_of_a_scene_has_plain_numbers(text):
    with pytest.raises(
        BadInput, match=r"--set 'handle\.mass_kg' must have decimal numbers, such as 0\.5 or 5e-4, not "
    ):
        scenes.value_of("handle.mass_kg", text)


def test_a_text_of_a_scene_may_have_an_underscore():
    assert scenes.value_of("name", "'1_0'") == "1_0"
    assert scenes.value_of("controller.output", "u_1") == "u_1"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["watch", "/dev/null", "--seconds", "1_0"], "--seconds must be a number, not '1_0'"),
        (["synth", "mhz", "--seeds", "1_0"], "--seeds must be a whole number of 1 to 99, not '1_0'"),
        (["connect", "/dev/null", "--baud", "9_600"], "--baud must be a whole number of 1 to 4e+06, not '9_600'"),
        (["accuracy", "--encoder-phase-error", "0_1"], "--encoder-phase-error must be a number, not '0_1'"),
    ],
)
def test_every_option_says_what_it_takes(monkeypatch, capsys, arguments, message):
    assert call(monkeypatch, capsys, *arguments) == (2, "", f"hardwall: error: {message}\n")
