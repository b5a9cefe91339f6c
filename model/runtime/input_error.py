"""The error for input that cannot be."""


class InputError(ValueError):
    """Invalid input: one line that says what is wrong with it, and what is accepted."""
