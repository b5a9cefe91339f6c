"""What every section of a scene is."""

from pydantic import BaseModel, ConfigDict


class Section(BaseModel):
    """A table of keys that are all known, of the types that are stated, and never change."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)
