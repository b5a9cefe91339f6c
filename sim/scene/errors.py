"""What is wrong with a scene."""


class SceneError(ValueError):
    """A scene that cannot be: one line, naming the file, the key and what is accepted."""
