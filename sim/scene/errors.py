"""The error of a scene."""

from ...model.runtime.input_error import InputError


class SceneError(InputError):
    """A scene is not valid. The message is one line: the file, the key and the accepted values."""
