"""Checks of a scene; every error is a sentence that begins with the key and says what is accepted."""

import difflib
import math
from typing import Any

from pydantic import BaseModel

from ...model.checks import FieldError
from ...model.quadrature_speed import max_edge_rate
from ..world import device
from ..world.euler import longest_s
from .build import device_of
from .schema import Scene

SAMPLES_MAX = 10**9
"""The most samples in a run's settling or measuring: a minute or two with the model, hours with the RTL."""
STEPS_MAX = 10_000
"""The most steps of a map in either direction, and the most steps of a fixed-step solver in a sample."""

# The scene keys of the model's words and fields, where the names differ.
KEYS = {
    "wall_stiffness": "wall.stiffness_n_per_m",
    "wall_damping": "wall.damping_n_s_per_m",
    "output_slew_limit": "controller.slew_limit_n_per_s",
    "count_m": "encoder.count_m",
}


def _key_of(field: str, scene: Scene) -> str:
    """Return the scene key of a word of the axis, or of a field of the axis or its gains."""
    if field in KEYS:
        return KEYS[field]
    controller = scene.controller
    section = "controller" if field in type(controller).model_fields else f"controller.gains.{controller.estimator}"
    return f"{section}.{field}"


def check(scene: Scene) -> None:
    """Raise ValueError for errors that the sections of a `Scene` cannot see alone; the message begins with the key."""
    _check_axis(scene)
    _check_protocol(scene)
    _check_wall(scene)
    if scene.amplifier is not None:
        _check_amplifier(scene)
    if scene.output is not None:
        _check_output(scene)
    _check_device(scene)
    if scene.zwidth is not None:
        _check_map(scene)


def _check_axis(scene: Scene) -> None:
    try:
        spec, outputs = scene.spec, scene.spec.design.estimator.outputs
        if scene.estimator_output not in outputs:
            raise FieldError("output", f"must be one of {', '.join(outputs)}, not {scene.estimator_output!r}")
        _check_start(scene)
        _ = scene.words
    except FieldError as error:
        raise ValueError(f"{_key_of(error.field, scene)} {error.message}") from None
    try:
        _ = scene.encoder.offsets
    except ValueError as error:
        raise ValueError(f"encoder.{error}") from None

    error_counts = max(map(abs, scene.encoder.offsets))
    fastest = spec.count_m * max_edge_rate(spec.clock_hz, scene.controller.glitch_clocks, error_counts)
    if spec.speed_max_m_per_s > fastest:
        raise ValueError(
            f"controller.speed_max_m_per_s must be at most {fastest:g}, the decoder's limit at this clock, count size, "
            f"glitch_clocks and edge error, not {spec.speed_max_m_per_s!r}"
        )


def check_hit(scene: Scene) -> None:
    """Raise ValueError for an invalid start or wall of an otherwise valid scene; the message begins with the key."""
    _check_start(scene)
    _check_wall(scene)


def _check_start(scene: Scene) -> None:
    start_m, travel_m = scene.protocol.start_m, scene.spec.travel_m
    if -start_m > travel_m:
        raise ValueError(f"protocol.start_m must be {-travel_m:g} to 0, within travel_m, not {start_m!r}")


def _check_protocol(scene: Scene) -> None:
    protocol, rate = scene.protocol, scene.spec.sample_hz
    longest = SAMPLES_MAX / rate
    for key in ("settle_s", "measure_s"):
        if not 0.5 < getattr(protocol, key) * rate <= SAMPLES_MAX:
            raise ValueError(
                f"protocol.{key} must be a sample of {1 / rate:g} s to {longest:g}, not {getattr(protocol, key)!r}"
            )
    if not 0.5 < protocol.mean_s * rate <= round(protocol.settle_s * rate):
        raise ValueError(
            f"protocol.mean_s must be a sample of {1 / rate:g} s to settle_s {protocol.settle_s:g}, "
            f"not {protocol.mean_s!r}"
        )


def _check_wall(scene: Scene) -> None:
    for name, most in (
        ("stiffness_n_per_m", scene.spec.stiffness_max_n_per_m),
        ("damping_n_s_per_m", scene.spec.damping_max_n_s_per_m),
    ):
        if not 0 <= getattr(scene.wall, name) <= most:
            raise ValueError(
                f"wall.{name} must be 0 to {most:g}, what the controller is for, not {getattr(scene.wall, name)!r}"
            )


def _check_amplifier(scene: Scene) -> None:
    if scene.amplifier.current_limit_a is not None and not (scene.motor and scene.amplifier.bandwidth_hz):
        raise ValueError("amplifier.current_limit_a needs amplifier.bandwidth_hz and a section motor: a current loop")
    delay_s, settle_s, rate = scene.amplifier.delay_s, scene.protocol.settle_s, scene.spec.sample_hz
    if delay_s > settle_s:
        raise ValueError(f"amplifier.delay_s must be 0 to settle_s {settle_s:g}, not {delay_s!r}")
    if not math.isclose(delay_s * rate, scene.delay_samples, abs_tol=1e-6):
        raise ValueError(f"amplifier.delay_s must be a whole number of samples of {1 / rate:g} s, not {delay_s!r}")


def _check_output(scene: Scene) -> None:
    output, clock_hz = scene.output, scene.spec.clock_hz
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
    parts = device_of(scene)
    if output.full_scale_n > parts.command_limit_n:
        raise ValueError(
            f"output.full_scale_n must be at most {parts.command_limit_n:g} N with pulses, all that the amplifier's "
            f"current or the motor's voltage gives: cut pulses are another force, not {output.full_scale_n!r}"
        )
    if period % output.pwm_steps:
        raise ValueError(
            f"output.pwm_steps must divide the {period} clocks of a carrier's period, not {output.pwm_steps!r}"
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
    if stable_s < step_s:
        raise ValueError(
            f"solver.step_s must be at most {stable_s:.4g}, in longer steps this device diverges of itself, "
            f"not {step_s!r}"
        )


def _check_map(scene: Scene) -> None:
    steps, spec = scene.zwidth, scene.spec
    for key, least, most in (
        ("stiffness_to_n_per_m", steps.stiffness_step_n_per_m, spec.stiffness_max_n_per_m),
        ("damping_to_n_s_per_m", steps.damping_from_n_s_per_m, spec.damping_max_n_s_per_m),
    ):
        if not least <= getattr(steps, key) <= most:
            raise ValueError(f"zwidth.{key} must be {least:g} to {most:g}, not {getattr(steps, key)!r}")
    for key, span in (
        ("stiffness_step_n_per_m", steps.stiffness_to_n_per_m),
        ("damping_step_n_s_per_m", steps.damping_to_n_s_per_m - steps.damping_from_n_s_per_m),
    ):
        if span > STEPS_MAX * getattr(steps, key):
            raise ValueError(
                f"zwidth.{key} must be at least {span / STEPS_MAX:g}, {STEPS_MAX} steps, not {getattr(steps, key)!r}"
            )


def sentence(error: dict[str, Any], scene: type[BaseModel]) -> str:
    """Return one pydantic error as 'key must ..., not value'."""
    key = ".".join(
        str(part) for part in error["loc"] if not str(part).startswith(("function-", "constrained", "list[", "float"))
    )
    limits = error.get("ctx", {})
    if error["type"] == "missing":
        return f"{key} is missing"
    if error["type"] == "extra_forbidden":
        return f"{key} is not a key of a scene{_suggestion(error['loc'], scene)}"
    if error["type"] in ("model_type", "dict_type"):
        return f"{key} must be a section, not {error['input']!r}"
    if key == "encoder.phase_error_counts":
        return f"{key} must be a finite number, or a list of four, not {error['input']!r}"
    relations = {"gt": "more than", "ge": "at least", "lt": "less than", "le": "at most"}
    accepted = " and ".join(f"{words} {limits[short]:g}" for short, words in relations.items() if short in limits)
    if not accepted:
        accepted = (
            error["msg"]
            .removeprefix("Input should be ")
            .replace("a valid ", "a ")
            .replace("a integer", "a whole number")
        )
    return f"{key} must be {accepted}, not {error['input']!r}"


def _suggestion(location: tuple, scene: type[BaseModel]) -> str:
    """Return a suggestion for a misspelt key: the nearest key of its section, or all keys of the section."""
    section: Any = scene
    for part in location[:-1]:
        kinds = [section.model_fields[part].annotation, *getattr(section.model_fields[part].annotation, "__args__", ())]
        section = next(kind for kind in kinds if isinstance(kind, type) and issubclass(kind, BaseModel))
    keys = [key for key in section.model_fields if key != "name"]
    near = difflib.get_close_matches(str(location[-1]), keys, 1)
    return f"; did you mean {near[0]}?" if near else f"; its section has {', '.join(keys) or 'no keys'}"
