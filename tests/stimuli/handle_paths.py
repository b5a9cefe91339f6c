"""Ways of a handle under a drive, and the energy that a passivity controller's observer sees on them."""

from hardwall.model.axis import passivity


def energies(params: passivity.Params, counts: list[int], drives: list[int]) -> list[int]:
    """Return the energy at every sample of a way, with a debt that is never paid: nothing of it is forgotten.

    Args:
        params: the observer's.
        counts: of every sample.
        drives: from every sample on, force LSB.
    """
    debt, kept = -(1 << 30), []
    state = passivity.START._replace(energy=debt, last_count=counts[0])
    for k, count in enumerate(counts):
        drive = drives[k - 1] if k else 0
        state, _, _ = passivity.step(params, state, count, 0, 0, drive, drive)
        kept.append(state.energy - debt)
    return kept
