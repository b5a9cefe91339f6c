"""Messages for bad values of options, in the words that a scene uses for its keys."""

import typer
from pydantic import Field, ValidationError
from typer.core import TyperOption

from ..model.checks import shown
from ..model.runtime.accepted import accepted


def refusal(error: typer.TyperException) -> str:
    """Return what is wrong with a call; with the value of an option, as 'OPTION must be ..., not VALUE'."""
    option, cause = getattr(error, "param", None), error.__cause__
    if not isinstance(cause, ValidationError) or not isinstance(option, TyperOption):
        return " ".join(error.format_message().split())
    return refused(option, cause.errors()[0]["input"])


def refused(option: TyperOption, value: object) -> str:
    """Return that an option must be another value than what was given."""
    limits = Field(ge=option.min, le=option.max).metadata
    return f"{option.opts[0]} must be {accepted(option.type_descriptor.annotation, limits)}, not {shown(value)}"
