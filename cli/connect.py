"""The command `connect`."""

from dataclasses import dataclass
from typing import Annotated, Any

import typer

from ..host import Axis
from ..host.port import BAUD
from ..model.register import Kind, Register
from ..model.runtime.result import Table, table_of, text_of
from .port import BaudOption, IdentityOption, PaceOption, PortArgument, axis_at
from .report import ReportOptions, reports

KINDS = tuple(kind for kind in Kind if kind not in (Kind.PULSE, Kind.CONSTANT))
"""The kinds of registers that have something to say."""


@dataclass(frozen=True)
class Board:
    """A board's description of itself.

    Attributes:
        summary: values, by key.
        rows: its registers, a dict each; empty if they were not asked for.
    """

    summary: dict[str, Any]
    rows: list[dict[str, Any]]

    def report(self) -> dict[str, Any]:
        return self.summary | ({"rows": self.rows} if self.rows else {})

    def tables(self) -> list[Table]:
        found = [Table({}, [[key, text_of(value)] for key, value in self.summary.items()])]
        if self.rows:
            rows = [[text_of(value) for value in row.values()] for row in self.rows]
            found.append(table_of(("address", "name", "kind", "unit"), ("value", "least", "most"), rows))
            found[-1] = Table({key: found[-1].columns[key] for key in self.rows[0]}, rows)
        return found

    def notes(self) -> list[str]:
        return []


@reports()
def command(
    options: ReportOptions,
    port: PortArgument,
    baud: BaudOption = BAUD,
    identity: IdentityOption = None,
    pace: PaceOption = None,
    registers: Annotated[
        bool, typer.Option("--registers", help="list every register, with its value, unit and range")
    ] = False,
) -> None:
    with axis_at(port, baud, identity, pace) as axis:
        summary = _summary(port, axis)
        rows = [_row(axis, each) for each in axis.device.registers.values() if each.kind in KINDS] if registers else []
    options.finish(Board(summary, rows))


def _summary(port: str, axis: Axis) -> dict[str, Any]:
    status = axis.status
    trip = status.trip
    return {
        "port": port,
        "identity": axis.device.identity,
        "clock_hz": axis.device.clock_hz,
        "capture_registers": axis.device.capture_registers,
        "state": status.state.name,
        "ready": status.ready,
        "referenced": status.referenced,
        "position_m": status.position_m,
        "velocity_m_per_s": status.velocity_m_per_s,
        "acceleration_m_per_s2": status.acceleration_m_per_s2,
        "force_n": status.force_n,
        "flags": list(status.flags),
        "a_channel_idle": status.a_channel_idle,
        "lease": None if axis.lease is None else axis.lease or "free",
        "first_causes": list(trip.first) if trip else [],
        "latched_causes": list(trip.causes) if trip else [],
        "link": {name.removeprefix("link_"): count for name, count in axis.counters.items()},
    }


def _row(axis: Axis, register: Register) -> dict[str, Any]:
    return {
        "address": f"{register.address:#06x}",
        "name": register.name,
        "kind": register.kind.value,
        "value": axis.read(register.name) * register.lsb,
        "unit": register.unit,
        "least": register.low * register.lsb,
        "most": register.high * register.lsb,
    }
