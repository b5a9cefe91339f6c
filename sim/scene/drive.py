"""The section `drive` of a scene: the drive stage of its board, and the amplifier that makes newtons of its output."""

from typing import Annotated, Literal

from pydantic import Field

from ...model.drive import dac, pdm, pwm
from ...model.drive.registry import STAGES
from ...model.drive.stage import UNITS, Amplifier, Stage, Unit
from .quantities import Current, ForcePerUnit, Offset, Rate, Voltage, number, whole
from .section import Section

AMPLIFIER = {
    "newtons_per_unit": ("newtons_per_volt", "newtons_per_ampere"),
    "full_scale": ("full_scale_v", "full_scale_a"),
    "offset": ("offset_v", "offset_a"),
}
"""The keys of the fields of an `Amplifier`, by `UNITS`."""
NEEDED = {"pdm": (), "pwm": ("pwm_hz", "dead_time_s"), "dac": ("dac_bits", "dac_serial_hz")}
"""The keys that a stage cannot be without."""
OF_A_DAC = "dac_"
"""How the keys of a DAC begin; the rest is the name of the field."""


class DriveSection(Section):
    """The drive stage of the scene's board, and what makes newtons of its output: see `hardwall.model.drive`.

    The amplifier is described either in volts or in amperes. Without this section a board has pulses; their full
    density stands for the drive format's full scale.
    """

    stage: Literal[tuple(STAGES)]
    newtons_per_volt: ForcePerUnit | None = None
    full_scale_v: Voltage | None = None
    offset_v: Offset | None = None
    newtons_per_ampere: ForcePerUnit | None = None
    full_scale_a: Current | None = None
    offset_a: Offset | None = None
    inverted: bool = False
    pwm_hz: Rate | None = None
    dead_time_s: number(*pwm.DEAD_TIME_S) | None = None
    dac_bits: whole(*dac.BITS) | None = None
    dac_serial_hz: Rate | None = None
    dac_coding: Literal[dac.CODINGS] | None = None
    dac_header_bits: whole(*dac.HEADER_BITS) | None = None
    dac_header: whole(0, (1 << dac.HEADER_BITS[1]) - 1) | None = None
    dac_trailing_bits: whole(*dac.TRAILING_BITS) | None = None
    dac_mode: whole(*dac.MODES) | None = None
    dac_setup: (
        Annotated[
            list[whole(0, (1 << dac.FRAME_BITS_MAX) - 1)],
            Field(min_length=1, max_length=dac.SETUP_MAX),
        ]
        | None
    ) = None

    @property
    def unit(self) -> Unit:
        """The unit of what the stage, or the amplifier behind it, puts out."""
        return UNITS[self.newtons_per_volt is None]

    def key_of(self, field: str) -> str:
        """Return the key of a field of the stage, or of its amplifier."""
        if field in AMPLIFIER:
            return AMPLIFIER[field][UNITS.index(self.unit)]
        return OF_A_DAC + field if self.stage == "dac" else field

    def check(self) -> None:
        """Raise ValueError if a key lacks, or is of another stage or unit; the message begins with the key."""
        given = self.model_dump(exclude_none=True).keys()
        others = {keys[1 - UNITS.index(self.unit)] for keys in AMPLIFIER.values()}
        if not {self.key_of("newtons_per_unit"), self.key_of("full_scale")} <= given or given & others:
            pairs = ", or ".join(" and ".join(keys) for keys in zip(*list(AMPLIFIER.values())[:2], strict=True))
            raise ValueError(f"drive must have {pairs}, and not both")
        for stage, needed in NEEDED.items():
            own = {key for key in given if key in needed or (stage == "dac" and key.startswith(OF_A_DAC))}
            if stage != self.stage and own:
                raise ValueError(f"drive.{min(own)} must be absent, because drive.stage is {self.stage}, not {stage}")
        for key in NEEDED[self.stage]:
            if key not in given:
                raise ValueError(f"drive.{key} is missing")

    @property
    def made(self) -> Stage:
        """The stage of a section that `check` accepts.

        Raises:
            ValueError: if a value is impossible; the message names the field.
        """
        given = self.model_dump(exclude_none=True)
        values = {field: given.get(keys[UNITS.index(self.unit)], 0.0) for field, keys in AMPLIFIER.items()}
        amplifier = Amplifier(unit=self.unit, inverted=self.inverted, **values)
        if self.stage == "pdm":
            return pdm.Stage(amplifier=amplifier)
        if self.stage == "pwm":
            return pwm.Stage(amplifier=amplifier, pwm_hz=given["pwm_hz"], dead_time_s=given["dead_time_s"])
        own = {key.removeprefix(OF_A_DAC): value for key, value in given.items() if key.startswith(OF_A_DAC)}
        return dac.Stage(amplifier=amplifier, **own | {"setup": tuple(own.get("setup", ()))})
