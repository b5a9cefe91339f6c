"""A page in a browser that shows a board, and sets and arms it; see `docs/guide/feel.md`."""

from ...model.runtime.extras import need

need("panel")
