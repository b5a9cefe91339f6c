"""Polynomials over a leg, in its time 0 to 1: bounds that are cheap to compute, and the times of passing a value.

An array holds one polynomial in each column: three sums, then the coefficients. The expansion of a motion fills it.
"""

from ...model.runtime.compiled import compiled

END, BEND, STEEPENING, FIRST = 0, 1, 2, 3
"""The rows of a polynomial: its value at the end; two sums of its coefficients' sizes; and its first coefficient."""
NEVER, UNSURE = 2.0, -1.0
"""Values in place of a time: the polynomial does not pass the bound, or the leg is too long to tell."""


@compiled
def measure(series):
    """Fill `END`, `BEND` and `STEEPENING` of every polynomial, with the last terms first as they are the smallest."""
    for row in range(FIRST):
        for number in range(series.shape[1]):
            series[row, number] = 0.0
    for j in range(len(series) - 1, FIRST + 1, -1):
        for number in range(series.shape[1]):
            size = abs(series[j, number])
            series[END, number] += series[j, number]
            series[BEND, number] += size
            series[STEEPENING, number] += (j - FIRST) * size
    for number in range(series.shape[1]):
        series[END, number] += series[FIRST + 1, number]
        series[END, number] += series[FIRST, number]


@compiled
def shorten(series, part):
    """Restrict the polynomials to the first part of the leg, 0 to 1."""
    share = 1.0
    for j in range(FIRST + 1, len(series)):
        share *= part
        for number in range(series.shape[1]):
            series[j, number] *= share
    measure(series)


@compiled
def value(series, number, time):
    """Return a polynomial's value and its slope at a time of the leg, 0 to 1."""
    result = slope = 0.0
    for j in range(len(series) - 1, FIRST - 1, -1):
        slope = slope * time + result
        result = result * time + series[j, number]
    return result, slope


@compiled
def at(series, number, time):
    """Return a polynomial's value at a time of the leg, 0 to 1."""
    return series[END, number] if time == 1.0 else value(series, number, time)[0]


@compiled
def stays(series, number, low, high):
    """Return whether a polynomial surely stays within low <= p < high, and whether it is monotone over the leg."""
    start, slope, bend = series[FIRST, number], series[FIRST + 1, number], series[BEND, number]
    inside = low <= start + min(slope, 0.0) - bend and start + max(slope, 0.0) + bend < high
    return inside, abs(slope) > series[STEEPENING, number]


@compiled
def root(series, number, wanted, after):
    """Return the time, `after` to 1, at which a monotone polynomial passes `wanted`, by Newton's method.

    Where it begins with a slope of 0, the wanted value says which way it goes.
    """
    low, high = after, 1.0
    slope = series[FIRST + 1, number]
    rising = slope > 0.0 or (slope == 0.0 and wanted > series[FIRST, number])
    time = 0.5 * (low + high)
    for _ in range(60):
        here, slope = value(series, number, time)
        if here == wanted:
            break
        if (here > wanted) == rising:
            high = time
        else:
            low = time
        following = time - (here - wanted) / slope if slope != 0.0 else low
        if not low < following < high:
            following = 0.5 * (low + high)
        if abs(following - time) < 1e-15:
            break
        time = following
    return time


@compiled
def leaves(series, number, low, high, surely):
    """Return the time (0 to 1) when a polynomial leaves low <= p < high, or `NEVER`, or `UNSURE` unless `surely`."""
    inside, one_way = stays(series, number, low, high)
    if inside:
        return NEVER
    if not one_way and not surely:
        return UNSURE
    start, end = series[FIRST, number], series[END, number]
    if low <= end < high:
        return NEVER
    bound = low if end < low else high
    # Rounding may have put its start outside on this side; from the other side it crosses the whole range.
    if (start < low and bound == low) or (start >= high and bound == high):
        return 0.0
    return root(series, number, bound, 0.0)
