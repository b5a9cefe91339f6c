"""The base of every section of a scene."""

from pydantic import BaseModel, ConfigDict


class Section(BaseModel):
    """A table of keys that are all known, of the types that are stated, and never change."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)
