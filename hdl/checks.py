"""What constructors of components check of their parameters."""


def check_int(name: str, value: int, least: int, most: int | None = None) -> None:
    """Raise TypeError unless `value` is an int, ValueError unless it is `least` to `most` (None: no end)."""
    if isinstance(value, bool) or not isinstance(value, int):
        raise TypeError(f"{name} must be an int, not {value!r}")
    if value < least or (most is not None and value > most):
        accepted = f"{least} or more" if most is None else f"{least} to {most}"
        raise ValueError(f"{name} must be {accepted}, not {value!r}")
