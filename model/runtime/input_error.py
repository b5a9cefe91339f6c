"""The error for input that cannot be."""


class InputError(ValueError):
    """Invalid input. The message is one line: the fault, and the accepted values."""
