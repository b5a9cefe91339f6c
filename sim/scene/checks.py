"""Checks of a scene. Every error is a sentence: it begins with the key, and gives the accepted values."""

import math

from ...model.axis.virtual_mass import FIELD
from ...model.checks import FieldError, shown
from ...model.encoder.quadrature_speed import max_edge_rate
from ...model.runtime.accepted import plain
from ...model.words import Word
from ..world import device
from ..world.euler import longest_s
from ..world.presliding import fastest_per_s
from .build import bristled_of, device_of
from .quantities import MARGIN, rounded_down, rounded_up
from .schema import Scene
from .several import GAIN_WORDS

SAMPLES_MAX = 10**9
"""The most samples in a run's settling or measuring: a minute or two with the model, hours with the RTL."""
STEPS_MAX = 10_000
"""The most steps of a map in either direction, and the most steps of a fixed-step solver in a sample."""
DELAY_SAMPLES_MAX = 10**6
"""The most drives that a late amplifier holds."""

# The scene keys of the model's words and fields, where the names differ.
KEYS = {
    "wall_stiffness": "wall.stiffness_n_per_m",
    "wall_damping": "wall.damping_n_s_per_m",
    "passivity_damping": "passivity.damping_n_s_per_m",
    "wall_mass": "virtual_mass.in_wall_kg",
    "free_mass": "virtual_mass.in_free_space_kg",
    FIELD: "virtual_mass.most_kg",
    "output_slew_limit": "controller.slew_limit_n_per_s",
    "count_m": "encoder.count_m",
}
OF_THE_STAGE = "stage."
"""How the names of the fields of a drive stage begin in messages."""
WALL_MAX = {"wall_stiffness": "stiffness_max_n_per_m", "wall_damping": "damping_max_n_s_per_m"}
"""The field of the axis that limits each word of the wall, more narrowly than the word itself."""
COUPLING_CLOCKS = 2
"""Clocks from a changed drive to the next strobe that a surface takes to move."""


def _key_of(field: str, scene: Scene) -> str:
    """Return the scene key of a word of the axis, or of a field of the axis, its gains or its drive stage."""
    if scene.drive is not None and field.startswith(OF_THE_STAGE):
        return f"drive.{scene.drive.key_of(field.removeprefix(OF_THE_STAGE))}"
    if field in KEYS:
        return KEYS[field] if scene.coupling is None else KEYS[field].replace("wall.", "coupling.")
    controller, field = scene.controller, GAIN_WORDS.get(field, field)
    section = "controller" if field in type(controller).model_fields else f"controller.gains.{controller.estimator}"
    return f"{section}.{field}"


def check(scene: Scene) -> None:
    """Raise ValueError for errors that the sections of a `Scene` cannot see alone; the message begins with the key."""
    scene.encoder.check()
    scene.encoder.check_at(scene.edges_hz, scene.controller.sample_hz)
    if scene.drive is not None:
        scene.drive.check()
    if scene.hand is not None:
        scene.hand.check()
    if scene.motor is not None:
        scene.motor.check(scene.amplifier and scene.amplifier.bandwidth_hz)
    _check_axis(scene)
    _check_protocol(scene)
    if scene.amplifier is not None:
        _check_amplifier(scene)
    if scene.output is not None:
        _check_output(scene)
    if scene.presliding is not None:
        _check_presliding(scene)
    _check_device(scene)
    if scene.zwidth is not None:
        _check_map(scene)


def _check_axis(scene: Scene) -> None:
    try:
        spec, outputs = scene.spec, scene.spec.design.estimator.outputs
        if scene.estimator_output not in outputs:
            raise FieldError("output", f"must be one of {', '.join(outputs)}, not {scene.estimator_output!r}")
        _check_start(scene)
        if scene.coupling is not None:
            _check_coupling(scene)
        if scene.virtual_mass is not None:
            _check_virtual_mass(scene)
        # A word holds more than the wall may have.
        _check_wall(scene)
        _check_words(scene)
    except FieldError as error:
        raise ValueError(f"{_key_of(error.field, scene)} {error.message}") from None
    error_counts = scene.encoder.error_counts_at(scene.edges_hz)
    fastest = spec.count_m * max_edge_rate(spec.clock_hz, scene.glitch_clocks, error_counts)
    if spec.speed_max_m_per_s > fastest * MARGIN:
        raise ValueError(
            f"controller.speed_max_m_per_s must be at most {rounded_down(fastest)}, the decoder's limit at this clock, "
            f"count size, glitch_clocks and edge error, not {spec.speed_max_m_per_s!r}"
        )
    apart_s, least_s = scene.encoder.edge_separation_s, 1 / max_edge_rate(spec.clock_hz, scene.glitch_clocks)
    if apart_s is not None and apart_s * MARGIN < least_s:
        raise ValueError(
            f"encoder.edge_separation_s must be at least {rounded_up(least_s)}, the decoder's limit at this clock and "
            f"glitch_clocks, not {apart_s!r}"
        )


def _check_virtual_mass(scene: Scene) -> None:
    """Raise FieldError if the virtual mass may be as large as what the drive moves: no estimator is stable there."""
    masses = {"handle.mass_kg": scene.handle.mass_kg}
    if scene.transmission is not None:
        masses["transmission.motor_mass_kg"] = scene.transmission.motor_mass_kg
    key = min(masses, key=masses.__getitem__)
    if scene.spec.design.mass.words[0].si_max >= masses[key]:
        raise FieldError(FIELD, f"must be less than {key}, {masses[key]:g}, not {scene.virtual_mass.most_kg!r}")


def _check_words(scene: Scene) -> None:
    """Raise FieldError if a wall or a limit does not fit its word, or is so small that its word would be 0."""
    si = scene.parameters
    for word in scene.spec.design.words:
        value = si.get(word.name)
        if word.name in KEYS | GAIN_WORDS and value and not _fits(word, value):
            raise FieldError(word.name, f"must be {_range_of(word, scene)}, not {value!r}")
    scene.spec.design.encode(**si)


def _fits(word: Word, value: float) -> bool:
    """Return whether a value has a word that is not 0."""
    try:
        return word.from_si(value) != 0
    except FieldError:
        return False


def _range_of(word: Word, scene: Scene) -> str:
    """Return the values that a word's key accepts in a scene; its printed numbers are accepted, too."""
    if word.low > 0:
        return f"{word.si_min:g} to {word.si_max:g}"
    half = word.to_si(1) / 2
    least = f"{half:g}" if word.from_si(float(f"{half:g}")) else repr(half)
    above_0 = f"{least} (half of its word's LSB) to "
    if word.low < 0:
        return f"0, or {above_0}{word.si_max:g} of either sign"
    if word.name == "passivity_damping":
        return f"0, or {above_0}{word.si_max:g}"
    if word.name not in WALL_MAX:
        return f"{above_0}{word.si_max:g}"
    # A wall of no stiffness is free space; a coupling of none couples nothing.
    or_0 = "" if scene.coupling is not None and word.name == "wall_stiffness" else "0, or "
    return f"{or_0}{above_0}{plain(getattr(scene.spec, WALL_MAX[word.name]))} (what the controller is for)"


def check_hit(scene: Scene) -> None:
    """Raise ValueError for an invalid wall of an otherwise valid scene; the message begins with the key."""
    _check_wall(scene)


def _check_start(scene: Scene) -> None:
    start_m, travel_m = scene.protocol.start_m, scene.spec.travel_m
    if not -travel_m <= start_m < 0:
        raise ValueError(
            f"protocol.start_m must be less than 0 and at least {-travel_m:g}, for controller.travel_m, not {start_m!r}"
        )


def _check_protocol(scene: Scene) -> None:
    protocol, rate = scene.protocol, scene.spec.sample_hz
    times = ("settle_s", "mean_s", "measure_s", "longest_s")
    for key in (key for key in times if getattr(protocol, key) is not None):
        value = getattr(protocol, key)
        if not value * rate > 0.5:
            raise ValueError(f"protocol.{key} must be at least one sample of {1 / rate:g} s, not {value!r}")
        if not value * rate <= SAMPLES_MAX:
            raise ValueError(
                f"protocol.{key} must be at most {SAMPLES_MAX / rate:g}, {SAMPLES_MAX:g} samples, not {value!r}"
            )
    if not protocol.mean_s * rate <= round(protocol.settle_s * rate):
        raise ValueError(
            f"protocol.mean_s must be at most protocol.settle_s, {protocol.settle_s:g}, not {protocol.mean_s!r}"
        )


def _check_wall(scene: Scene) -> None:
    for name, limit in WALL_MAX.items():
        value = getattr(scene.held_by, KEYS[name].removeprefix("wall."))
        if not 0 <= value <= getattr(scene.spec, limit):
            word = next(word for word in scene.spec.design.words if word.name == name)
            raise ValueError(f"{_key_of(name, scene)} must be {_range_of(word, scene)}, not {shown(value)}")


def _check_coupling(scene: Scene) -> None:
    spec = scene.spec
    scene.coupling.check(spec.sample_hz)
    clocks = spec.design.latency_to_drive + COUPLING_CLOCKS
    if spec.clocks_per_sample < clocks:
        raise ValueError(
            f"controller.sample_hz must be at most {spec.clock_hz // clocks} beside a coupling, whose surface moves "
            f"between a drive and the next sample, not {spec.sample_hz!r}"
        )


def _check_amplifier(scene: Scene) -> None:
    if scene.amplifier.current_limit_a is not None and not (scene.motor and scene.amplifier.bandwidth_hz):
        raise ValueError("amplifier.current_limit_a needs amplifier.bandwidth_hz and a section motor: a current loop")
    delay_s, settle_s, rate = scene.amplifier.delay_s, scene.protocol.settle_s, scene.spec.sample_hz
    if delay_s > settle_s:
        raise ValueError(f"amplifier.delay_s must be at most protocol.settle_s, {settle_s:g}, not {delay_s!r}")
    if scene.delay_samples > DELAY_SAMPLES_MAX:
        raise ValueError(
            f"amplifier.delay_s must be at most {DELAY_SAMPLES_MAX / rate:g}, {DELAY_SAMPLES_MAX} samples, "
            f"not {delay_s!r}"
        )
    if not math.isclose(delay_s * rate, scene.delay_samples, abs_tol=1e-6):
        raise ValueError(f"amplifier.delay_s must be a whole number of samples of {1 / rate:g} s, not {delay_s!r}")


def _check_output(scene: Scene) -> None:
    output, clock_hz = scene.output, scene.spec.clock_hz
    if scene.drive is not None:
        raise ValueError("output must be absent beside a section drive, whose stage says the steps of the force")
    pulses = output.pwm_carrier_hz is not None, output.pwm_steps is not None
    if (output.dac_bits is not None) + any(pulses) != 1 or pulses[0] != pulses[1]:
        raise ValueError("output must have dac_bits, or pwm_carrier_hz and pwm_steps, and not both")
    if not pulses[0]:
        return
    period, rest = divmod(clock_hz, output.pwm_carrier_hz)
    if rest or period < 2:
        raise ValueError(
            f"output.pwm_carrier_hz must be controller.clock_hz {clock_hz} divided by a whole number from 2, "
            f"not {output.pwm_carrier_hz!r}"
        )
    most_hz = device.LEGS_MAX // 2 * scene.spec.sample_hz
    if output.pwm_carrier_hz > most_hz:
        raise ValueError(
            f"output.pwm_carrier_hz must be at most {most_hz}, {device.LEGS_MAX // 2} pulses a sample, "
            f"not {output.pwm_carrier_hz!r}"
        )
    parts = device_of(scene)
    if output.full_scale_n > parts.command_limit_n * MARGIN:
        raise ValueError(
            f"output.full_scale_n must be at most {rounded_down(parts.command_limit_n)} N with pulses, all that the "
            "amplifier's current or the motor's voltage gives: cut pulses are another force, "
            f"not {output.full_scale_n!r}"
        )
    if period % output.pwm_steps:
        raise ValueError(
            f"output.pwm_steps must divide the {period} clocks of a carrier's period, not {output.pwm_steps!r}"
        )


def _check_presliding(scene: Scene) -> None:
    scene.presliding.check(scene.handle.coulomb_n)
    if device_of(scene) is not None:
        raise ValueError(
            "presliding must be absent beside amplifier.bandwidth_hz, motor, transmission, hand, solver and pulses of "
            "output: bristles are solved for a handle that the force drives directly"
        )
    fastest, most = fastest_per_s(bristled_of(scene)), device.LEGS_MAX * scene.spec.sample_hz
    if not fastest <= most:
        raise ValueError(
            f"presliding and handle must change at no more than {most:g} 1/s together, {device.LEGS_MAX} steps of the "
            f"solver a sample, not {fastest:g}"
        )


def _check_device(scene: Scene) -> None:
    parts = device_of(scene)
    if parts is None:
        return
    fastest, most = device.fastest_per_s(parts), device.LEGS_MAX * device.LEG_RATE * scene.spec.sample_hz
    if not fastest <= most:
        raise ValueError(
            f"handle, amplifier, motor, transmission and hand must change at no more than {most:g} 1/s together, "
            f"{device.LEGS_MAX} steps of the solver a sample, not {fastest:g}"
        )
    if scene.solver is not None:
        _check_solver(scene, parts)


def _check_solver(scene: Scene, parts: device.Device) -> None:
    step_s, sample_s = scene.solver.step_s, 1 / scene.spec.sample_hz
    least, most = sample_s / STEPS_MAX, sample_s * (1 + 1e-9)
    if not least <= step_s <= most:
        raise ValueError(
            f"solver.step_s must be {least:g} to {sample_s:g}, from {STEPS_MAX} steps a sample to one, not {step_s!r}"
        )
    stable_s = longest_s(parts, step_s)
    if stable_s < least:
        raise ValueError(
            f"solver must be left out: this device diverges of itself in steps longer than {stable_s:.4g} s, "
            f"more than {STEPS_MAX} a sample"
        )
    if step_s > stable_s * MARGIN:
        raise ValueError(
            f"solver.step_s must be at most {rounded_down(stable_s)}, in longer steps this device diverges of itself, "
            f"not {step_s!r}"
        )


def _check_map(scene: Scene) -> None:
    steps = scene.zwidth
    for key, least_key in (
        ("stiffness_to_n_per_m", "stiffness_step_n_per_m"),
        ("damping_to_n_s_per_m", "damping_from_n_s_per_m"),
    ):
        value, least = getattr(steps, key), getattr(steps, least_key)
        if value < least:
            raise ValueError(f"zwidth.{key} must be at least zwidth.{least_key}, {least:g}, not {value!r}")
    for key, span in (
        ("stiffness_step_n_per_m", steps.stiffness_to_n_per_m),
        ("damping_step_n_s_per_m", steps.damping_to_n_s_per_m - steps.damping_from_n_s_per_m),
    ):
        if span > STEPS_MAX * getattr(steps, key):
            raise ValueError(
                f"zwidth.{key} must be at least {span / STEPS_MAX:g}, {STEPS_MAX} steps, not {getattr(steps, key)!r}"
            )
