"""Pictures of results. What options must know of them is here, so that a call can be refused without Matplotlib."""

SUFFIXES = (".pdf", ".png", ".svg")
"""The kinds of a picture's file."""
