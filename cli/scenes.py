"""The options that choose a scene, its changes and what is measured; and the checks of their values."""

from typing import Annotated, Any, Literal

import typer

from ..model.checks import shown
from ..model.estimators import registry
from ..sim.boards.parts import PARTS
from ..sim.estimates.accuracy import FASTEST, LEARNED, RATES_HZ, SCENE, outputs
from ..sim.scene.errors import SceneError
from ..sim.scene.load import load, names, toml_of
from ..sim.walls.methods import Curve, label
from ..sim.walls.worst_variant import HELD_BY
from .errors import BadInput
from .options import numbers_of
from .plain_numbers import has_other_numbers, is_plain, plain_number

PartName = Literal[tuple(PARTS)]


def _scenes(incomplete: str) -> list[str]:
    """Return the scenes whose names begin so, for the completion of a shell."""
    return [name for name in names() if name.startswith(incomplete)]


def _scene_argument(kind: Any, default: bool | str) -> Any:
    """Return the type of the argument for a scene; its help names the default."""
    said = f"the scene: {', '.join(names())}, or a .toml file"
    argument = typer.Argument(metavar="SCENE", help=said, autocompletion=_scenes, show_default=default)
    return Annotated[kind, argument]


SceneArgument = _scene_argument(str, True)
SceneOfBoardArgument = _scene_argument(str | None, "the board's own, at a clock that it makes")
SceneOrOfBoardArgument = _scene_argument(
    str | None, "seed-2011; with --board the board's own, at a clock that it makes"
)
DeviceOption = Annotated[PartName, typer.Option(help="FPGA to place and route for")]
EncoderSetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="encoder.KEY=VALUE", help="give the encoder an error, by a key of a scene's section [encoder]"
    ),
]


def changes_of(assignments: list[str] | None, **options: Any) -> dict[str, Any]:
    """Return scene changes from `--set` and from options for single keys (None: not given)."""
    changes: dict[str, Any] = {}
    for assignment in assignments or []:
        key, equals, text = assignment.partition("=")
        if not equals or not key:
            raise BadInput(f"--set must be KEY=VALUE, not {shown(assignment)}")
        _change(changes, "--set", key, value_of(key, text) if text else None)
    for name, value in options.items():
        if value is not None:
            key = name.replace("__", ".")
            _change(changes, f"--{key.rpartition('.')[2].partition('_')[0]}", key, value)
    return changes


def encoder_of(assignments: list[str] | None) -> dict[str, Any]:
    """Return the errors of the encoder that is measured, by their keys of a scene, from `--set`."""
    changes = changes_of(assignments)
    for key in changes:
        if not key.startswith("encoder.") or key == "encoder.count_m":
            raise BadInput(f"--set must be of an error of the encoder, encoder.KEY=VALUE, not {shown(key)}")
    if changes:
        try:
            load(SCENE, FASTEST | {key: value for key, value in changes.items() if key != LEARNED})
        except SceneError as error:
            raise BadInput(str(error)) from None
    return changes


def _change(changes: dict[str, Any], option: str, key: str, value: Any) -> None:
    """Add the change of a key by an option; a key may be changed once, and not after keys inside of it."""
    for earlier in changes:
        if f"{earlier}.".startswith(f"{key}."):
            raise BadInput(f"{option} must change each key once, not {shown(key)} after {shown(earlier)}")
    changes[key] = value


def value_of(key: str, text: str) -> Any:
    """Return the value of a key on the command line: one TOML value; what is no TOML is a text of its own."""
    if not text.isprintable():
        raise BadInput(f"--set {shown(key)} must be one value on one line, not {shown(text)}")
    if has_other_numbers(text):
        raise BadInput(f"--set {shown(key)} must have decimal numbers, such as 0.5 or 5e-4, not {shown(text)}")
    try:
        # Nothing can follow a value in an inline table but another key.
        found = toml_of(f"table = {{ value = {text} }}")
    except ValueError:
        # `.35` and `2.` are numbers as people write them, and TOML does not.
        return plain_number(text) if is_plain(text) else text
    if found.keys() != {"table"} or found["table"].keys() != {"value"}:
        raise BadInput(f"--set {shown(key)} must be one value, not {shown(text)}")
    return found["table"]["value"]


GAINS = ("controller.estimator", "controller.output", "controller.gains")
WALL = ("wall.stiffness_n_per_m", "wall.damping_n_s_per_m")


def refuse(changes: dict[str, Any], keys: tuple[str, ...], instead: str) -> None:
    """Refuse changes of scene keys that the command sets itself; `instead` is the reason."""
    for key in changes:
        if key.startswith(keys):
            raise BadInput(f"--set {shown(key)} must be absent (this command sets it): {instead}")


def refuse_for_maps(changes: dict[str, Any], estimators: str) -> None:
    """Refuse changes of methods, for the reason `estimators`, and changes of walls."""
    refuse(changes, GAINS, estimators)
    refuse(changes, WALL, "see the scene's section zwidth")


def curves_of(wanted: str | None, papers: dict[str, Curve] | None = None) -> list[Curve]:
    """Return the estimators of a list NAME[:OUTPUT],...; the name `all` stands for all of them.

    Args:
        wanted: the list; None for all.
        papers: methods of the founding paper, whose names are accepted too.
    """
    papers, curves = papers or {}, []
    try:
        for name in (word.strip() for word in ("all" if wanted is None else wanted).split(",")):
            if name in papers:
                curves.append(papers[name])
                continue
            every = registry.ESTIMATORS if name == "all" else [name]
            curves += [Curve(label(*pair), *pair) for estimator in every for pair in outputs(estimator)]
    except ValueError as error:
        also = f", or of {', '.join(papers)}" if papers else ""
        raise BadInput(f"--estimators: {error}{also}") from None
    return list({curve.label: curve for curve in curves}.values())


def hands_of(wanted: str) -> list[str]:
    """Return the hands of a list NAME,...; the name `all` stands for all of them."""
    hands = []
    for name in (word.strip() for word in wanted.split(",")):
        if name not in ("all", *HELD_BY):
            raise BadInput(f"--hands must be all, or some of {', '.join(HELD_BY)}, not {shown(name)}")
        hands += HELD_BY if name == "all" else [name]
    return list(dict.fromkeys(hands))


def rates_of(text: str, option: str) -> list[int]:
    """Return the rates (Hz) of a list given with an option."""
    return [int(rate) for rate in numbers_of(text, option, *RATES_HZ, "Hz", whole=True)]
