"""Errors between a host and a board. Every message is one line: what happened, and what to do."""


class HostError(RuntimeError):
    """The base of all errors between this program and the board."""


class PortError(HostError):
    """The port cannot be opened, or was unplugged."""


class SilentError(HostError):
    """The board does not answer, or has stopped answering."""


class ForeignError(HostError):
    """Another device answers, or an axis that this version does not know."""


class ChangedError(HostError):
    """The board is not the expected one, or was reset since it was read."""


class RefusedError(HostError):
    """The board refuses a request.

    Attributes:
        code: the exception of Modbus, 1 to 4.
    """

    def __init__(self, message: str, code: int):
        super().__init__(message)
        self.code = code


class HeldError(HostError):
    """Another program holds the lease of a board that is shared."""


class LateError(HostError):
    """A request waited too long and is not sent."""


class NotReadyError(HostError):
    """The axis is in a state in which it cannot do this; the message says why."""


class TrippedError(HostError):
    """The axis is TRIPPED: its drive is 0 until the causes are acknowledged and it is armed again."""


class ConfigError(ValueError):
    """A file is not a configuration, or has a value out of the range of its word."""
