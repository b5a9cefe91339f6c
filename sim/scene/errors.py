"""The error of a scene."""


class SceneError(ValueError):
    """A scene is not valid; the message is one line that names the file, the key and what is accepted."""
