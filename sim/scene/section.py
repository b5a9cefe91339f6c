"""The base of every section of a scene."""

from pydantic import BaseModel, ConfigDict


class Section(BaseModel):
    """A table with known keys of stated types, which never changes."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)
