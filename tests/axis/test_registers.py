"""The register map: addresses by their rule, values there and back, the identity, and what is refused."""

import dataclasses
import json
import zlib

import pytest

from hardwall.model.arithmetic.fixed import SQ, UQ
from hardwall.model.axis.registers import ACTIVE, WRITTEN, RegisterMap
from hardwall.model.axis.supervised import Design
from hardwall.model.estimators import registry
from hardwall.model.register import Kind, Register
from stimuli.specs import SPECS, spec
from stimuli.supervised import supervised


@pytest.mark.parametrize("name", SPECS)
@pytest.mark.parametrize("estimator", registry.ESTIMATORS)
def test_every_axis_has_a_map(name, estimator):
    registers = supervised(name, estimator)
    taken = [place for each in registers.registers for place in range(each.address, each.address + each.size)]
    assert taken == sorted(set(taken))
    assert all(each.address % 2 == 0 for each in registers.registers if each.kind.wide)
    assert registers.pulses[0].name == "commit"
    assert registers.pulses[0].address + 1 == registers.words[0].address == WRITTEN
    for word, active in zip(registers.words, registers.active, strict=True):
        assert active.address - word.address == ACTIVE - WRITTEN
    design = Design(registers.spec)
    assert [word.name for word in registers.words] == ["preload_count", *(word.name for word in design.committed)]
    live = (*design.live, *registers.capture.words)
    assert [word.name for word in registers.live] == ["heartbeat", "acknowledged", *(word.name for word in live)]
    assert len({each.name for each in registers.registers}) == len(registers.registers)


def test_the_addresses_that_every_host_knows():
    registers = supervised("mhz")
    assert [each.address for each in registers.registers if each.kind is Kind.CONSTANT] == [0, 2, 4, 6, 8, 10, 12]
    known = {"drive": 0x20, "stamp": 0x32, "state": 0x40, "link_errors": 0x64, "commit": 0x7F, "clear_flags": 0x7E}
    known |= {"acknowledge": 0x79, "preload_count": 0x80, "encoder_glitch_clocks": 0x82, "active_encoder_invert": 0xA4}
    known |= {"capture_start": 0x78, "capture_trigger": 0x77, "origin_shift": 0x76, "capture_state": 0x56}
    known |= {"heartbeat": 0xC0, "acknowledged": 0xC2, "supervisor_force_limit": 0xC4}
    assert {name: registers[name].address for name in known} == known


def test_the_map_in_the_device_is_the_map():
    registers = supervised("mhz")
    described = json.loads(zlib.decompress(registers.compressed))
    rows = {row[1]: dict(zip(described["columns"], row, strict=True)) for row in described["registers"]}
    assert described["identity"] == registers.identity
    assert len(registers.compressed) < 2048
    word, row = registers["wall_position"], rows["wall_position"]
    assert row == {
        "address": word.address,
        "name": "wall_position",
        "kind": "word",
        "signed": 1,
        "bits": 21,
        "si_per_lsb": 1e-6,
        "unit": "m",
        "least": -(1 << 20),
        "most": (1 << 20) - 1,
        "reset": 0,
    }


def test_every_change_of_spec_or_map_changes_the_identity():
    base = spec("mhz")
    others = [
        RegisterMap(base),
        RegisterMap(base, 0),
        RegisterMap(base, 16),
        RegisterMap(dataclasses.replace(base, travel_m=0.2)),
        RegisterMap(dataclasses.replace(base, force_max_n=41.0)),
        RegisterMap(spec("mhz", "fdm")),
    ]
    assert len({each.identity for each in others}) == len(others)
    assert RegisterMap(base).identity == RegisterMap(base).identity


@pytest.mark.parametrize("name", ["mhz", "wide"])
def test_words_go_there_and_back(name):
    for register in supervised(name).registers:
        for word in {register.low, register.high, register.reset}:
            assert register.from_registers(register.to_registers(word)) == word
        with pytest.raises(ValueError, match=rf"^{register.name} must be {register.low} to {register.high}, not "):
            register.to_registers(register.high + 1)
        with pytest.raises(ValueError, match=rf"^{register.name} must have {register.size} registers, not 3$"):
            register.from_registers((0, 0, 0))


def test_a_board_may_have_no_capture_memory():
    registers = RegisterMap(spec("mhz"), 0)
    assert registers.capture is None
    assert not [each.name for each in registers.registers if "capture" in each.name and each.kind is not Kind.CONSTANT]


def test_every_meaning_is_a_sentence():
    for register in supervised("mhz").registers:
        assert register.meaning.endswith(".")
        assert not register.meaning[0].islower()


def test_what_cannot_be_is_refused():
    with pytest.raises(TypeError, match=r"spec must be an AxisSpec, not 3$"):
        RegisterMap(3)
    with pytest.raises(ValueError, match=r"capture_registers must be 0 to 32768, not 32769$"):
        RegisterMap(spec("mhz"), capture_registers=32769)
    for wrong in (7, 8, 12, 24, 32760):
        with pytest.raises(
            ValueError, match=rf"^capture_registers must be 0, or 8 times a power .* from 2 on, not {wrong}$"
        ):
            RegisterMap(spec("mhz"), capture_registers=wrong)
    with pytest.raises(ValueError, match=r"^more must have at most 32 bits, not UQ\(33, 0\)$"):
        Register("more", Kind.STATUS, UQ(33, 0), "More.")
    with pytest.raises(ValueError, match=r"^more must have at most 16 bits, not UQ\(17, 0\)$"):
        Register("more", Kind.PULSE, UQ(17, 0), "More.")
    with pytest.raises(ValueError, match=r"^more must reset to, and end within, 0 to 2147483647, not 0 and 429496729"):
        Register("more", Kind.WORD, UQ(32, 0), "More.")
    with pytest.raises(ValueError, match=r"^reset of more must be -8 to 7, not 8$"):
        Register("more", Kind.WORD, SQ(4, 0), "More.", reset=8)
    with pytest.raises(KeyError, match=r"register must be one of layout, .*, not 'nothing'"):
        supervised("mhz")["nothing"]
