"""What is wrong with what was given."""


class BadInput(Exception):
    """One line: what is wrong with what was given, and what is accepted."""
