"""The map of several axes: a bank is the map of one axis, at its place; what it says beside; what is refused."""

import json
import zlib
from dataclasses import replace

import pytest

from hardwall.model.axes.axis import AXES_MAX, AxesSpec
from hardwall.model.axes.registers import BANK, AxesMap
from hardwall.model.axis.registers import CAPTURE_REGISTERS, MAP, RegisterMap
from hardwall.model.register import Kind
from hardwall.model.spec import AxisSpec
from stimuli.supervised_axes_world import FIELDS, slow


@pytest.mark.parametrize(("estimator", "registers"), [("fdm", 0), ("fdm", CAPTURE_REGISTERS), ("window", 128)])
def test_a_bank_is_the_map_of_one_axis(estimator, registers):
    fields = {**FIELDS, "clock_hz": 1_000_000, "estimator": estimator}
    one, several = RegisterMap(AxisSpec(**fields), registers), AxesMap(AxesSpec(**fields, axes=3), registers)
    mine = several.registers[: len(several.registers) - (registers > 0)]
    # Only the longest way of a runaway is shorter, by what a rota may add to it.
    alike = [replace(each, most=None) if each.name == "supervisor_runaway" else each for each in mine]
    assert [each for each in alike if each.kind is not Kind.CONSTANT] == [
        each for each in one.registers if each.kind is not Kind.CONSTANT
    ]
    longest = max((1 << several.spec.count_width - 1) - several.spec.clocks_per_sample, one["supervisor_runaway"].reset)
    assert several["supervisor_runaway"].high == longest
    # The capture memory has a word in addition, which is the last of all.
    assert [(each.name, each.low, each.high) for each in several.registers[len(mine) :]] == (
        [("capture_axis", 0, 2)] if registers else []
    )
    constants = {each.name: each.address for each in one.registers if each.kind is Kind.CONSTANT} | {"axes": 14}
    assert {each.name: each.address for each in several.registers if each.kind is Kind.CONSTANT} == constants


def test_every_axis_has_its_place_and_the_banks_end_before_the_map():
    registers = AxesMap(slow(AXES_MAX, "fdm"))
    assert AXES_MAX * BANK <= MAP
    for axis in (0, 1, AXES_MAX - 1):
        assert registers.of_axis("arm", axis).address == registers["arm"].address + 0x100 * axis
    assert registers.capture
    assert {each.name for each in registers.shared if each.kind is Kind.PULSE} == {"capture_start", "capture_trigger"}
    for each in registers.shared:
        assert registers.of_axis(each.name, 0) == each
        with pytest.raises(ValueError, match=f"^axis must be 0 for {each.name}, which there is once"):
            registers.of_axis(each.name, 1)


def test_the_map_in_the_device_has_one_bank_and_their_number():
    registers = AxesMap(slow(5, "fdm"))
    described = json.loads(zlib.decompress(registers.compressed))
    assert (described["banks"], described["identity"]) == (5, registers.identity)
    assert [row[1] for row in described["registers"]] == [
        each.name for each in registers.registers if each.kind is not Kind.CONSTANT
    ]
    assert (registers["axes"].reset, registers["capture_registers"].reset) == (5, 0)
    assert registers.identification[True, 1][-4:] == b"axes"


def test_every_number_of_axes_has_its_identity():
    identities = {AxesMap(slow(axes, "fdm")).identity for axes in (1, 2, 3, 32)}
    assert len(identities | {AxesMap(slow(2, "window")).identity}) == 5
    assert AxesMap(slow(2, "fdm")).identity in identities


@pytest.mark.parametrize(("spare", "records"), [(4, 0), (5, 2048)])
def test_a_rota_that_is_shorter_than_a_record_has_no_capture_memory(spare, records):
    spec = slow(3, "fdm", spare)
    assert spec.clocks_per_sample == 4 + spare
    assert AxesMap(spec)["capture_registers"].reset == 8 * records
    assert AxesMap(spec, 0).capture is None
    if not records:
        with pytest.raises(ValueError, match=r"^sample_hz must leave 9 clocks for a sample that is captured, so at mo"):
            AxesMap(spec, 128)


def test_what_cannot_be_is_refused():
    with pytest.raises(TypeError, match=r"^spec must be an AxesSpec, not 3$"):
        AxesMap(3)
    with pytest.raises(ValueError, match=r"^capture_registers must be 0, or 8 times a power of two from 2 on, not 9$"):
        AxesMap(slow(2, "fdm", 5), 9)
    registers = AxesMap(slow(2, "fdm"))
    with pytest.raises(ValueError, match=r"^axis must be 0 to 1, not 2$"):
        registers.of_axis("arm", 2)
    with pytest.raises(ValueError, match=r"^axis must be 0 for heartbeat, which there is once for all axes, not 1$"):
        registers.of_axis("heartbeat", 1)
    with pytest.raises(KeyError, match="register must be one of layout, "):
        registers.of_axis("nothing", 0)
