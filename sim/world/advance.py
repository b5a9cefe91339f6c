"""Advancing a device and its encoder together over an interval of constant force: one contract, three solvers.

A rigid handle is advanced here, in closed form between its turns and edges; `taylor` and `euler` register theirs.
"""

from ...model.compiled import by_type, compiled
from .encoder import level, next_cell, stamp
from .rigid import Rigid, glide, net_force, reach, resume, sticks, turn, turned


@by_type
def advance_quietly(plant, motion, cell, force_n, interval):
    """Return (motion, quiet): the motion after an interval, and whether it is certain that nothing happened meanwhile.

    Where `quiet` is false (an edge or a turn is likely) the motion means nothing and the interval is for `advance`.
    This is the path of nearly every interval of a closed loop, so it handles no array: merely to pass an array to
    a compiled function costs more than to advance the handle.
    """


@by_type
def advance(plant, encoder, motion, cell, force_n, interval, clock, clocks, edge_clocks, edge_levels, n_edges):
    """Advance plant and encoder together over one interval of constant applied force.

    Args:
        plant: a `plant.Rigid`, a `drivetrain.Train` or a `fixed_step.Stepped`.
        encoder: an `Encoder`.
        motion: a `plant.Motion` of a `Rigid`, else a `drivetrain.State`.
        cell: the `Cell` that holds the encoder's position at the start; `locate` gives the first.
        force_n: motor and wall together (N), positive towards positive positions.
        interval: the `plant.span` of its length, or for the others its length (s).
        clock: number of the clock at which the interval starts.
        clocks: its length times `encoder.clock_hz`, at least 1.
        edge_clocks: int64 array for the stamps, which never decrease: clock < stamp <= clock + clocks.
        edge_levels: integer array for the pins after each edge, a | b << 1.
        n_edges: edges that the arrays hold already; new ones are appended. Where several share one clock, the pins
            show the last.

    Returns:
        (motion, cell, n_edges) at the end. Where the arrays are full n_edges is -1, and stays so: edges were lost, and
        the cell is that of the last one kept.
    """


@advance_quietly.register(Rigid)
@compiled
def _advance_quietly(plant, motion, cell, force_n, interval):
    coulomb = plant.coulomb
    if sticks(coulomb, motion, force_n):
        return motion, True
    end = glide(motion, net_force(coulomb, motion, force_n), interval)
    quiet = cell.lower_m <= end.position_m < cell.upper_m
    if motion.velocity_m_per_s * end.velocity_m_per_s > 0.0:
        return end, quiet
    if coulomb is None:
        # A turn reaches no farther than the initial velocity would: most turns need not be looked for.
        farthest_m = motion.position_m + motion.velocity_m_per_s * interval.seconds
        return end, quiet and cell.lower_m <= farthest_m < cell.upper_m
    return end, False


@advance.register(Rigid)
@compiled
def _advance(plant, encoder, motion, cell, force_n, interval, clock, clocks, edge_clocks, edge_levels, n_edges):
    handle, coulomb = plant
    if sticks(coulomb, motion, force_n):
        return motion, cell, n_edges
    room = min(len(edge_clocks), len(edge_levels))
    net_n = net_force(coulomb, motion, force_n)
    whole = glide(motion, net_n, interval)
    # A leg is a motion in one direction under one net force. A turn makes two of the interval.
    start, since_s = motion, 0.0
    end, until_s = whole, interval.seconds
    turning = turned(motion, whole)
    if turning:
        until_s, end = turn(handle, motion, net_n, interval.seconds)
    while True:
        while not cell.lower_m <= end.position_m < cell.upper_m and 0 <= n_edges < room:
            upwards = end.position_m >= cell.upper_m
            travel_m = (cell.upper_m if upwards else cell.lower_m) - start.position_m
            at_s = since_s + reach(handle, start, net_n, until_s - since_s, travel_m)
            cell = next_cell(encoder, cell, upwards)
            edge_clocks[n_edges] = clock + stamp(encoder, upwards, at_s, clocks)
            edge_levels[n_edges] = level(cell.number)
            n_edges += 1
        if not cell.lower_m <= end.position_m < cell.upper_m:
            n_edges = -1
        if not turning:
            return end, cell, n_edges
        turning = False
        start, since_s = end, until_s
        end, until_s = whole, interval.seconds
        if coulomb is not None:
            net_n = net_force(coulomb, start, force_n)
            end = resume(handle, coulomb, start, force_n, until_s - since_s)
