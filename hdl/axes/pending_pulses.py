"""Events of an axis's decoder, pins and host since its last sample, and since the last look of a turn."""

from collections.abc import Mapping
from typing import NamedTuple

from amaranth.hdl import Cat, Module, Signal, Value

from .axis import Axes
from .monitors import Sample
from .pipe import Pipe


class Asked(NamedTuple):
    """The host's requests: pulses, a bit for each axis; and with `acknowledge` the causes that it has read."""

    arm: Value
    disarm: Value
    acknowledge: Value
    acknowledged: Value


def turned(m: Module, written: Signal, pending: Value) -> Value:
    """Return for every axis whether a commit waits that will turn its encoder around, and so its wall.

    Args:
        m: the module.
        written: for every axis its encoder_invert, as the host has written it last.
        pending: for every axis, whether its words wait for its strobe; the strobe takes everything written until then.
    """
    inverted = Signal.like(written, name="inverted")
    m.d.sync += inverted.eq((pending & written) | (~pending & inverted))
    return pending & (written ^ inverted)


def encoders(pipe: Pipe, axes: Axes, levels: Mapping[str, Value], look: int) -> dict[str, Signal]:
    """Return the encoders' events since the last look in that stage, by name, a bit for each axis."""
    kinds = Cat(kind[0] for kind in axes.edge_kind)
    pulses = {
        "encoder_illegal": axes.illegal,
        "encoder_overspeed": axes.overspeed,
        "position_wrap": axes.wrapped,
        "unlike_a": levels["encoder_a"] ^ levels["encoder_a_n"],
        "unlike_b": levels["encoder_b"] ^ levels["encoder_b_n"],
        "edge_a": axes.stepped & ~kinds,
        "edge_b": axes.stepped & kinds,
    }
    return {name: pipe.waits(name, pulse, look) for name, pulse in pulses.items()}


def looked_at(pipe: Pipe, waiting: Mapping[str, Value], asked: Asked, look: int) -> dict[str, Value]:
    """Return the waiting events of the axis in the stage of the look, by name, a stage later.

    Args:
        pipe: the pipeline.
        waiting: what waits, by name, a bit for each axis.
        asked: the host's requests, which wait too.
        look: the stage.
    """
    m = pipe.m
    # One mask serves all axes: a later acknowledgement replaces the waiting ones.
    acknowledges, acknowledged = Signal(pipe.axes), Signal.like(asked.acknowledged, name="acknowledged_last")
    m.d.sync += acknowledges.eq(acknowledges & ~Cat(pipe.turns(look)))
    with m.If(asked.acknowledge.any()):
        m.d.sync += [acknowledges.eq(asked.acknowledge), acknowledged.eq(asked.acknowledged)]
    bits = {
        **waiting,
        "arm": pipe.waits("arm", asked.arm, look),
        "disarm": pipe.waits("disarm", asked.disarm, look),
        "acknowledge": acknowledges,
    }
    row = pipe.taken(pipe.of([Cat(each) for each in zip(*bits.values(), strict=True)], look), "looked_at")
    return {**dict(zip(bits, row, strict=True)), "acknowledged": pipe.taken(acknowledged)}


def sample(pipe: Pipe, axes: Axes, first: Value, index_bits: int, stage: int) -> Sample:
    """Return the sample whose velocity is there in a stage, with the last index before it.

    Args:
        pipe: the pipeline.
        axes: the axes.
        first: whether the sample in stage 0 is its axis's first one.
        index_bits: how many low bits of the count at an index edge are kept.
        stage: the stage.
    """
    m, indexed = pipe.m, Signal(pipe.axes)
    # A preload or a shift of the origin makes the place of an index before it void.
    m.d.sync += indexed.eq((axes.indexed | (indexed & ~Cat(pipe.turns(0)))) & ~(axes.preload | axes.origin_shift))
    marks = pipe.waits("preload", axes.preload, 0), pipe.waits("shift", axes.origin_shift, 0), indexed
    rows = []
    for number, mine in enumerate(zip(*marks, strict=True)):
        low = Signal(index_bits, name=f"index_low_{number}")
        # The edge that found it has counted away from it.
        back = Cat(1, (~axes.edge_down[number]).replicate(index_bits - 1))
        with m.If(axes.indexed[number]):
            m.d.sync += low.eq((axes.count[number] + back)[:index_bits])
        rows.append(Cat(*mine, low))
    row, first = pipe.later(pipe.of(rows, 0), stage), pipe.later(first, stage)
    return Sample(
        stage=stage,
        first=first,
        fresh=row[0] | first,
        shifted=row[1],
        shift=axes.preload_count,
        indexed=row[2],
        index_low=row[3:],
        count=axes.estimated_count,
        velocity=axes.velocity,
        saturated=axes.saturated,
    )
