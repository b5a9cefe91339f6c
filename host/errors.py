"""What may go wrong between a host and a board: every error says in one line what happened and what helps."""


class HostError(RuntimeError):
    """Something between this program and the board went wrong; the base of all others."""


class PortError(HostError):
    """The port cannot be opened, or is gone."""


class SilentError(HostError):
    """Nothing answers, or no longer."""


class ForeignError(HostError):
    """What answers is no axis that this version knows."""


class ChangedError(HostError):
    """The board is not the one that is expected, or was reset since it was read."""


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
    """What was asked for is too old to be done."""


class NotReadyError(HostError):
    """The axis cannot be armed, and why."""


class TrippedError(HostError):
    """The axis is TRIPPED: its drive is 0 until the causes are acknowledged and it is armed again."""


class ConfigError(ValueError):
    """A file of a configuration is none, or has a value that its word cannot hold."""
