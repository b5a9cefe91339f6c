"""Scenes: TOML files that describe the modelled device. A section or key that is absent is not modelled.

Units are in the keys. Every error is one line: the file, the key and the accepted values.
"""

import dataclasses
from functools import cached_property
from typing import Annotated, Any, Literal

from pydantic import Field, create_model

from ...model.axis.design import Timing
from ...model.axis.designed import DesignedAxis
from ...model.axis.virtual_mass import FIELD
from ...model.drive import pdm
from ...model.encoder.quadrature_speed import GLITCH_CLOCKS_MAX, SPEED_MARGIN, glitch_clocks_for
from ...model.estimators import registry
from ...model.requirements import EDGE_ERROR_COUNTS
from ...model.spec import AxisSpec
from .coupling_section import CouplingSection
from .drive import DriveSection
from .encoder_section import EncoderSection
from .hand_section import HandSection
from .motor_section import MotorSection
from .presliding_section import PreslidingSection
from .quantities import (
    Acceleration,
    Bandwidth,
    Current,
    Damping,
    EdgeErrorMax,
    Force,
    Gain,
    Jerk,
    Length,
    Mass,
    Part,
    Place,
    Rate,
    SignedMass,
    SlewRate,
    Speed,
    Step,
    Stiffness,
    Threshold,
    Time,
    or_none,
    whole,
)
from .section import Section


class HandleSection(Section):
    """The moving mass; without `coulomb_n` it has no dry friction."""

    mass_kg: Mass
    viscous_n_s_per_m: or_none(Damping) = 0.0
    coulomb_n: or_none(Force) | None = None


def _gains_section(name: str) -> type[Section]:
    """Return a section with the fields of an estimator's gains."""
    fields = dict.fromkeys(registry.design_of(name).gains_class.__annotations__, (Gain, ...))
    return create_model(f"{name.title()}Section", __base__=Section, **fields)


GainsSection = create_model(
    "GainsSection",
    __base__=Section,
    **{name: (_gains_section(name) | None, None) for name in registry.ESTIMATORS},
)


class ControllerSection(Section):
    """The axis: see `hardwall.model.spec.AxisSpec`. Gains are given by estimator, as in `[controller.gains.levant]`.
    Without `glitch_clocks` the glitch filter is the longest for the largest speed: see `Scene.glitch_clocks`."""

    clock_hz: Rate
    sample_hz: Rate
    actuation_hz: Rate
    travel_m: Length
    speed_max_m_per_s: Speed
    acceleration_max_m_per_s2: Acceleration
    jerk_max_m_per_s3: Jerk | None = None
    edge_error_max_counts: EdgeErrorMax = EDGE_ERROR_COUNTS
    force_max_n: Force
    force_resolution_n: Force
    stiffness_max_n_per_m: Stiffness
    damping_max_n_s_per_m: Damping
    estimator: Literal[tuple(registry.ESTIMATORS)] = "levant"
    output: str | None = None
    glitch_clocks: whole(0, GLITCH_CLOCKS_MAX) | None = None
    slew_limit_n_per_s: SlewRate | None = None
    gains: GainsSection = GainsSection()


class WallSection(Section):
    """The wall, its surface at position 0; without `forbid_pull` its damper may hold the leaving handle back."""

    stiffness_n_per_m: or_none(Stiffness)
    damping_n_s_per_m: or_none(Damping)
    forbid_pull: bool = False


class PassivitySection(Section):
    """An observer of the energy that the drive gives to the handle, and a controller. While more energy was given than
    taken, the controller damps by at most this much: see `hardwall.model.axis.passivity`."""

    damping_n_s_per_m: or_none(Damping)


class VirtualMassSection(Section):
    """A mass that the controller adds to the handle in the wall, and one in free space; below 0 it makes the handle
    lighter. Both are at most `most_kg`, which is less than the handle's mass: see `hardwall.model.axis.virtual_mass`.
    """

    most_kg: Mass
    in_wall_kg: SignedMass = 0.0
    in_free_space_kg: SignedMass = 0.0


class AmplifierSection(Section):
    """The amplifier; a key that is absent means no delay, lag or limit. A current limit needs motor and bandwidth."""

    delay_s: or_none(Time) = 0.0
    bandwidth_hz: Bandwidth | None = None
    current_limit_a: Current | None = None


class TransmissionSection(Section):
    """A cable between motor and handle; the motor's mass is rotor and pulley as felt at the handle."""

    stiffness_n_per_m: Stiffness
    damping_n_s_per_m: or_none(Damping) = 0.0
    motor_mass_kg: Mass
    motor_viscous_n_s_per_m: or_none(Damping) = 0.0
    encoder_at: Literal["handle", "motor"] = "handle"


class OutputSection(Section):
    """Steps of a converter (`dac_bits`), or pulses (`pwm_carrier_hz`, `pwm_steps` a period), up to +- full scale."""

    full_scale_n: Force
    dac_bits: whole(2, 32) | None = None
    pwm_carrier_hz: Rate | None = None
    pwm_steps: whole(2, 10**9) | None = None


class SolverSection(Section):
    """Steps of semi-implicit Euler of at most `step_s`, as in most simulations. Without this section the device is
    advanced exactly from event to event."""

    step_s: Step


LONGEST_S = 20.0
"""How long a run goes on at most whose scene does not say it, s."""


class ProtocolSection(Section):
    """A hit from rest at `start_m`, pushed towards the wall, and what is said of it.

    `hardwall.sim.walls.hit_statistics` has what is said.

    `start_m` and the phase of the push are one start among many that differ by chance alone: the place within a count,
    and the phase in a period of the force. See `hardwall.sim.walls.starts`.
    """

    start_m: Annotated[Place, Field(le=-1e-12)]
    start_counts: Part | None = None
    start_periods: Part = 0.0
    push_n: Force
    settle_s: Time
    mean_s: Time
    measure_s: Time
    longest_s: Time | None = None
    threshold_mm: Threshold
    verdict: Literal["detrended", "literal"] = "detrended"


class ZWidthSection(Section):
    """Steps of a map of stable walls: see `hardwall.sim.walls.boundary`."""

    stiffness_step_n_per_m: Stiffness
    stiffness_to_n_per_m: Stiffness
    damping_from_n_s_per_m: or_none(Damping)
    damping_to_n_s_per_m: or_none(Damping)
    damping_step_n_s_per_m: Damping


class Scene(Section):
    """One scene; `load` reads it, and checks what the sections cannot check alone."""

    name: str
    handle: HandleSection
    presliding: PreslidingSection | None = None
    encoder: EncoderSection
    controller: ControllerSection
    wall: WallSection
    coupling: CouplingSection | None = None
    passivity: PassivitySection | None = None
    virtual_mass: VirtualMassSection | None = None
    amplifier: AmplifierSection | None = None
    motor: MotorSection | None = None
    transmission: TransmissionSection | None = None
    hand: HandSection | None = None
    output: OutputSection | None = None
    drive: DriveSection | None = None
    solver: SolverSection | None = None
    protocol: ProtocolSection
    zwidth: ZWidthSection | None = None

    @property
    def requirements(self) -> dict[str, Any]:
        """The fields of a `DesignedAxis`, by name."""
        names = {field.name for field in dataclasses.fields(DesignedAxis)} - {"count_m", "gains"}
        fields = self.controller.model_dump(include=names, exclude_unset=False)
        gains = self.gains
        if gains is not None:
            gains = registry.design_of(self.controller.estimator).gains_class(**gains.model_dump())
        parts: dict[str, Any] = {name: getattr(self, name) is not None for name in ("passivity", "coupling")}
        parts[FIELD] = None if self.virtual_mass is None else self.virtual_mass.most_kg
        derived = {"glitch_clocks": self.glitch_clocks, **parts}
        return fields | derived | {"count_m": self.encoder.count_m, "gains": gains}

    @cached_property
    def spec(self) -> AxisSpec:
        """The axis."""
        return AxisSpec(stage=pdm.USUAL if self.drive is None else self.drive.made, **self.requirements)

    @property
    def gains(self) -> Section | None:
        """The gains of the scene's estimator; None for its default ones."""
        return getattr(self.controller.gains, self.controller.estimator)

    @property
    def held_by(self) -> WallSection | CouplingSection:
        """The spring and damper that the axis renders: the wall, or the coupling to a tool that touches the wall."""
        return self.wall if self.coupling is None else self.coupling

    @property
    def felt_n_per_m(self) -> float:
        """The stiffness felt at rest: the wall's, or of wall and coupling in series."""
        wall = self.wall.stiffness_n_per_m
        if self.coupling is None:
            return wall
        coupling = self.coupling.stiffness_n_per_m
        return wall * coupling / (wall + coupling)

    @property
    def timing(self) -> Timing:
        """The clocks at which the axis samples and changes its drive."""
        return self.spec.design.timing

    @property
    def edges_hz(self) -> float:
        """The rate of edges at the largest speed."""
        return self.controller.speed_max_m_per_s / self.encoder.count_m

    @property
    def glitch_clocks(self) -> int:
        """The glitch filter: the scene's own, or the longest that its speed and the errors of its encoder leave."""
        given = self.controller.glitch_clocks
        if given is not None:
            return given
        error_counts = self.encoder.error_counts_at(SPEED_MARGIN * self.edges_hz)
        clock_hz = self.controller.clock_hz
        return min(glitch_clocks_for(self.edges_hz / clock_hz, error_counts), self.encoder.glitch_clocks_max(clock_hz))

    @property
    def estimator_output(self) -> str:
        """The estimator's output that the wall uses."""
        outputs = self.spec.design.estimator.outputs
        return outputs[0] if self.controller.output is None else self.controller.output

    @property
    def parameters(self) -> dict[str, float]:
        """Run-time parameters in SI units, by word; the count is 0 at the start, so the wall is at -`start_m`.

        With a coupling, the tool is at the start, too, and the wall acts on the tool.
        """
        si = {
            "encoder_glitch_clocks": self.glitch_clocks,
            "wall_stiffness": self.held_by.stiffness_n_per_m,
            "wall_damping": self.held_by.damping_n_s_per_m,
        }
        if self.coupling is None:
            si |= {"wall_position": -self.protocol.start_m, "wall_forbid_pull": self.wall.forbid_pull}
        else:
            si |= {"wall_two_sided": True, "wall_forbid_pull": False}
        si |= self.spec.design.estimator.choose(self.estimator_output)
        if self.passivity is not None:
            si["passivity_damping"] = self.passivity.damping_n_s_per_m
        if self.virtual_mass is not None:
            si |= {"wall_mass": self.virtual_mass.in_wall_kg, "free_mass": self.virtual_mass.in_free_space_kg}
        if self.controller.slew_limit_n_per_s is not None:
            si["output_slew_limit"] = self.controller.slew_limit_n_per_s
        return si

    @property
    def words(self) -> dict[str, int]:
        """The run-time parameters as the hardware's words."""
        return self.spec.design.encode(**self.parameters)

    def hitting(
        self, stiffness_n_per_m: float, damping_n_s_per_m: float, start: tuple[float, float] | None = None
    ) -> "Scene":
        """Return the scene with another wall, and with another start (place and phase) if one is given.

        The axis depends on neither, and is not derived again.
        """
        wall = {"stiffness_n_per_m": stiffness_n_per_m, "damping_n_s_per_m": damping_n_s_per_m}
        changes = {} if start is None else dict(zip(("start_counts", "start_periods"), start, strict=True))
        protocol = self.protocol.model_copy(update=changes)
        return self.model_copy(update={"wall": self.wall.model_copy(update=wall), "protocol": protocol})

    @property
    def sticking_n(self) -> float:
        """The most that dry friction holds at rest."""
        bristles = self.presliding
        return (bristles and bristles.static_n) or self.handle.coulomb_n or 0.0

    @property
    def delay_samples(self) -> int:
        """Delay of the amplifier, in samples."""
        return 0 if self.amplifier is None else round(self.amplifier.delay_s * self.controller.sample_hz)

    @property
    def samples(self) -> int:
        """Number of samples of the protocol, for settling and one window of measuring together."""
        return self.settled + self.measured

    @property
    def settled(self) -> int:
        """Number of samples of the settling."""
        return round(self.protocol.settle_s * self.controller.sample_hz)

    @property
    def measured(self) -> int:
        """Number of samples of a window of the measuring."""
        return round(self.protocol.measure_s * self.controller.sample_hz)

    @property
    def most_samples(self) -> int:
        """Number of samples of a run whose verdict takes the most windows."""
        if self.protocol.verdict == "literal":
            return self.samples
        longest = round((self.protocol.longest_s or LONGEST_S) * self.controller.sample_hz)
        return self.settled + max((longest - self.settled) // self.measured, 1) * self.measured
