"""The error of a scene."""

from ...model.runtime.input_error import InputError


class SceneError(InputError):
    """A scene is not valid; the message is one line that names the file, the key and what is accepted."""
