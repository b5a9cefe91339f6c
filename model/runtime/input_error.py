"""The error for what a user gave and cannot be: of a scene, a file, a setting of the environment."""


class InputError(ValueError):
    """Invalid input: one line that says what is wrong with it, and what is accepted."""
