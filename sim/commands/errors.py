"""The error for invalid input."""


class BadInput(Exception):
    """Invalid input: one line that says what is wrong with it, and what is accepted."""
