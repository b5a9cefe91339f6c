"""One step of a velocity estimator: the kernel that every estimator registers a variant of."""

from ..compiled import by_type


@by_type
def estimate(params, state, seen, restart):
    """Take one sample: return (state, velocity, flags).

    Args:
        params: an estimator's `Params` (integer words) or `FloatParams` (the same algorithm in float64).
        state: its state, from the start or the previous call; an array in it is written in place.
        seen: a `quadrature.Seen`; its count is a signed word that may have wrapped.
        restart: true to forget the past: this sample counts as the first.

    Returns:
        The new state; the velocity in words of the design's `velocity` format (float: counts a sample); and the
        flags that this sample raised, one bit each.
    """
