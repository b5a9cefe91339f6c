"""The contract that every registered estimator fulfils: its gains, its design, its kernels, its component."""

from dataclasses import fields, is_dataclass

import numpy as np
import pytest
from amaranth.hdl import Shape
from amaranth.lib.wiring import In, Out

from hardwall.hdl.encoder.quadrature import Seen as Bus
from hardwall.hdl.estimators import registry as hardware
from hardwall.hdl.estimators.estimate import EstimatorBlock
from hardwall.model.arithmetic.fixed import SQ
from hardwall.model.axis.axis import Axis
from hardwall.model.encoder.quadrature import Seen, seen_count
from hardwall.model.estimators import registry
from hardwall.model.estimators.acceleration import Accelerated
from hardwall.model.estimators.estimate import EstimatorDesign, EstimatorGains, estimate
from hardwall.model.words import Word
from stimuli.specs import spec

every = pytest.mark.parametrize("name", registry.ESTIMATORS)
AXES = ("paper", "mhz", "narrow", "wide")


def design(name: str, axis: str = "mhz") -> EstimatorDesign:
    return spec(axis, name).design.estimator


def reset_words(d: EstimatorDesign) -> dict[str, int]:
    return {word.name: word.reset for word in d.words}


def flat(value) -> list:
    """Return the numbers in a tuple of tuples, with arrays flattened."""
    if isinstance(value, tuple):
        return [number for part in value for number in flat(part)]
    return value.tolist() if isinstance(value, np.ndarray) else [value]


@every
def test_the_class_names_what_it_promises(name):
    kind = registry.design_of(name)
    assert issubclass(kind, EstimatorDesign)
    assert kind.name == name
    assert len(set(kind.outputs)) == len(kind.outputs) > 0
    assert len(set(kind.flags)) == len(kind.flags) > 0
    assert set(kind.inputs) <= set(Seen._fields)
    assert kind.inputs[0] == "count"
    assert kind.uses_stamps() == any(each.startswith("stamp") for each in kind.inputs)


@every
def test_gains_are_frozen_and_follow_from_the_axis(name):
    kind = registry.design_of(name).gains_class
    assert issubclass(kind, EstimatorGains)
    assert is_dataclass(kind)
    gains = kind.default(spec("mhz", name))
    assert gains == kind.default(spec("mhz", name))
    assert hash(gains) == hash(kind.default(spec("mhz", name)))
    for field in fields(kind):
        with pytest.raises(ValueError, match=rf"^{field.name} must be .*, not -1.0$"):
            kind(**{other.name: -1.0 if other == field else 1.0 for other in fields(kind)})
    for field in fields(kind)[:1]:
        with pytest.raises(AttributeError):
            setattr(gains, field.name, 1.0)


@pytest.mark.parametrize("axis", AXES)
@every
def test_formats_and_words_are_what_the_axis_wires(name, axis):
    of, d = spec(axis, name), design(name, axis)
    assert (d.count_width, d.stamp_width) == (of.count_width, of.stamp_width)
    assert isinstance(d.velocity, SQ)
    assert isinstance(d.latency, int)
    assert d.latency >= 1
    assert all(isinstance(word, Word) for word in d.words)
    names = [word.name for word in d.words]
    assert len(set(names)) == len(names)
    assert all(each.startswith(f"{name.replace('-', '_')}_") for each in names)
    assert set(names) <= {word.name for word in of.design.words}
    assert (d.output_word() in names) == (len(d.outputs) > 1)
    for number, output in enumerate(d.outputs):
        assert d.choose(output) == ({d.output_word(): number} if len(d.outputs) > 1 else {})
    with pytest.raises(ValueError, match=rf"^output of {name} must be one of {', '.join(d.outputs)}, not 'no'$"):
        d.choose("no")


@every
def test_every_run_has_a_start_of_its_own(name):
    d = design(name)
    for floating in (False, True):
        first, second = d.start(floating), d.start(floating)
        assert flat(first) == flat(second)
        arrays = [part for part in flat_parts(first) if isinstance(part, np.ndarray)]
        assert not any(mine is other for mine in arrays for other in flat_parts(second))
    assert all(isinstance(number, int) for number in flat(d.start()))


def flat_parts(value) -> list:
    """Return the leaves of a tuple of tuples."""
    return [leaf for part in value for leaf in flat_parts(part)] if isinstance(value, tuple) else [value]


@every
def test_both_kernels_begin_with_zero_and_keep_the_kinds_of_their_state(name):
    d = design(name)
    gains = spec("mhz", name).design.gains
    integer, real = d.params(reset_words(d)), d.float_params(gains, d.outputs[0], {})
    assert type(integer) is not type(real)
    for params, floating in ((integer, False), (real, True)):
        state = d.start(floating)
        for count in (5, 5, 6):
            before = state
            state, velocity, flags = estimate(params, state, seen_count(count), 0)
            assert type(state) is type(before)
            assert len(flat(state)) == len(flat(before))
            assert isinstance(velocity, float | np.floating) == floating
            assert flags == 0
            assert count == 6 or velocity == 0
        # A restart forgets the past: its sample is the first again.
        _, velocity, _ = estimate(params, state, seen_count(-1000), 1)
        assert velocity == 0


@every
def test_the_float_kernel_takes_the_selected_output_and_the_gains_in_si(name):
    axis = spec("mhz", name)
    for output in axis.design.estimator.outputs:
        exact = Axis(axis, True, **axis.design.estimator.choose(output))
        assert exact.params.estimator == axis.design.estimator.float_params(axis.design.gains, output, {})
    for word in axis.design.estimator.words:
        if word.unit:
            changed = Axis(axis, True, **{word.name: word.to_si(max(word.reset // 2, word.low))}).params.estimator
            assert flat(changed) != flat(Axis(axis, True).params.estimator)


@every
def test_the_component_is_its_designs(name):
    d = design(name)
    block = hardware.block_of(d)
    assert isinstance(block, EstimatorBlock)
    assert type(block) is hardware.ESTIMATORS[name]
    assert isinstance(d, block.design_class)
    assert (block.design, block.latency) == (d, d.latency)
    members = block.signature.members
    assert list(members) == [
        "strobe",
        "restart",
        "seen",
        *(word.name for word in d.words),
        "velocity",
        "saturated",
        "valid",
        *(["acceleration"] if isinstance(d, Accelerated) else []),
    ]
    assert members["seen"].flow == In
    assert members["seen"].signature.flip().members == Bus(d.count_width, d.stamp_width).members
    for word in d.words:
        assert members[word.name] == In(Shape(word.format.width, word.format.signed))
    assert members["velocity"] == Out(Shape(d.velocity.width, signed=True))
    assert members["saturated"] == Out(len(d.flags))


@every
def test_a_design_of_another_is_refused(name):
    other = design("levant" if name == "fdm" else "fdm")
    with pytest.raises(TypeError, match=r"^design must be a \w+\.Design, not <"):
        hardware.ESTIMATORS[name](other)
    with pytest.raises(TypeError, match=r"not 3$"):
        hardware.ESTIMATORS[name](3)


def test_the_bus_has_what_the_model_sees():
    assert tuple(Bus(20, 24).members) == Seen._fields
