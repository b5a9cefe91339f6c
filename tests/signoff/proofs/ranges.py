"""What registers hold, which induction needs to know: promised, and proven with the widths of the block."""

from amaranth.hdl import Cat, Mux, Value
from amaranth.lib import wiring

from hardwall.hdl.axis.output import Output
from hardwall.hdl.encoder.quadrature import Quadrature
from hardwall.hdl.estimators import foaw, least_squares
from hardwall.hdl.wires import port
from hardwall.model.arithmetic.divisionless import digits
from hardwall.model.encoder.quadrature import START
from hardwall.model.estimators.edge_kalman_design import Design
from hardwall.model.estimators.foaw import TAPS
from hardwall.model.estimators.levant_adaptive import FALL, LEVELS

from .bench import Bench
from .of_arithmetic import root_keeps


def phase(bench: Bench, stage: Output) -> None:
    bench.within(phase=(0, stage.design.decimation - 1))


def start(bench: Bench, decoder: Quadrature) -> None:
    bench.within(starting=(0, START.starting))


def levants(bench: Bench, block: wiring.Component) -> None:
    velocity, error = block.design.velocity, block.design.error
    root_keeps(bench, "root.")
    bench.within(u1=velocity.max, next_u1=velocity.max, lead=error.max + velocity.max)


def levant_alone(bench: Bench, block: wiring.Component) -> None:
    """Promise that u1 with the steps of the digits so far leaves room for those of the digits that are left.

    A sum goes up by a digit's place, takes in two bits, and adds three steps at most.
    """
    inner, design, root_path = bench.inner, block.design, "square_root."
    root_keeps(bench, root_path)
    total, left, digits = inner["total"], inner[f"{root_path}left"], len(inner["low"]) // 2
    rooting = bench.state("ROOT")
    bench.promise(rooting == (left != 0))
    bench.promise(bench.state("PREPARE") | (inner["e"] >= -design.error.max) & (inner["e"] <= design.error.max))
    lambda_ = (1 << len(inner["step"]) - 1) - 1
    bench.within(step=lambda_, triple=3 * lambda_, relay=design.alpha.max)
    finer = len(inner["step"]) - 1 - design.lambda_.width + design.product - design.velocity.f
    room = (((-design.velocity.min << finer) + lambda_ + 1) >> 2 * digits + 1) + 1
    for taken in range(digits + 1):
        bench.promise((left != digits - taken) | (total >= -room) & (total <= room))
        room = 4 * room + 3 + 3 * lambda_
    shifted = Cat(inner["low"][-2:], total).as_signed()
    for number, more in enumerate((0, inner["step"], inner["step"] << 1, inner["triple"])):
        bench.promise(~rooting | (inner[f"sum_{number}"] == shifted + more))


def levant_higher(bench: Bench, block: wiring.Component) -> None:
    """Assume that the octaves are within the range of their word and stay; promise the octave of what is no zero."""
    of_powers(bench, block, held_word(bench, block))


def adaptive(bench: Bench, block: wiring.Component) -> None:
    """Assume and promise this, too; promise that the law stays in its range, and a level is left for every doubling."""
    held_word(bench, block)
    (word,), last, inner = block.design.words, int(max(block.design.holds)) - 1, bench.inner
    of_powers(bench, block, bench.past(inner["octaves"]))
    bench.within(level=(0, LEVELS), octaves=(word.low - LEVELS, word.high), longest=(0, last), calm=(0, last))
    bench.promise(inner["level"] + FALL * inner["doublings"] <= LEVELS + FALL - 1)


def held_word(bench: Bench, block: wiring.Component) -> Value:
    """Assume that the octaves are within the range of their word and stay; return them."""
    (word,) = block.design.words
    octaves, stays = port(block, word.name), bench.constant(word.format.width)
    bench.assume((octaves >= word.low) & (octaves <= word.high) & (octaves == stays.as_signed()))
    return octaves


def of_powers(bench: Bench, block: wiring.Component, octaves: Value) -> None:
    """Promise the octave of what is no zero, for the octaves of the clock in which it was found."""
    powers = block.design.powers
    size, octave, taken = bench.past(bench.inner["size"], 2), bench.inner["powers.octave"], bench.inner["powers.run"][1]
    for place in range(len(size)):
        leads = size[place:] == 1
        bench.promise(~taken | ~leads | (octave == place + powers.params.offset - octaves))


def past(bench: Bench, block: wiring.Component) -> None:
    design = block.design.history
    bench.within(**{"history.phase": (0, design.every - 1), "history.step": design.change.max})


def edges(bench: Bench, block: wiring.Component) -> None:
    design = block.design
    bench.within(**{"edges.phase": (0, design.half - 1), "edges.moved": (0, design.edges_max)})


def digits_left(bench: Bench, block: wiring.Component) -> None:
    """Promise that digits are left of every quotient under way, and no more than it has."""
    edges(bench, block)
    left, machine = bench.inner["speed.left"], bench.inner["speed.fsm_state"]
    bench.promise(left <= digits(block.design.velocity.width)[0])
    bench.promise((left != 0) | (machine == machine.init))


def fit(bench: Bench, block: wiring.Component) -> None:
    past(bench, block)
    bench.within(clock=(0, least_squares.FIRST + block.design.taps))


def nothing(bench: Bench, block: wiring.Component) -> None:
    """Promise nothing more."""


def search(bench: Bench, block: wiring.Component) -> None:
    past(bench, block)
    bench.within(clock=(0, foaw.FIRST + TAPS + 3))


def levant_edge(bench: Bench, block: wiring.Component) -> None:
    """Promise what the error is made of, and what the states that use a time or a length find of it.

    The length of a time comes a clock after it. Shifts by a length of less than the shortest interval's are never used,
    for such an interval corrects nothing; nor is a time cut by one bit more than `kept` tells, which has no
    acceleration.
    """
    inner, d, p = bench.inner, block.design, block.design.params({word.name: word.reset for word in block.design.words})
    root_keeps(bench, "root.")
    way = ((1 << d.distance.width - 1) * d.clocks << d.place.f) + (1 << d.place.width)
    bench.within(way=way, moved=way << p.place_shift, e=d.error.max)
    measure, length, correct, first = inner["measure"], inner["length"], inner["correct"], d.shortest + 1
    timing = bench.state("TIME", "TURN")
    bench.promise(~timing | (inner["size"] <= len(measure)) & (measure >> inner["size"] == 0))
    bench.promise(~timing | (inner["time"] == measure >> inner["cut"]))
    bench.promise(~timing | measure[-1] | (inner["kept"] == d.turn_span - inner["cut"]))
    bench.promise(~bench.state("TIME") | ~measure[-1] | (inner["a"] == 0))
    lately = (inner["now"] - inner["stamp"])[: len(measure)] >> first == 0
    came = (measure != 0) | (inner["passed"] != 0)
    bench.promise(~bench.state("DECISION") | ~came | inner["waited"] | lately)
    bench.promise(~bench.state("TIME", "TURN PRODUCT") | ~inner["young"] | ~inner["anchor"] & lately)
    bench.promise(~bench.state("TURN") | ~inner["young"] | ~measure[-1])
    bench.promise(~bench.state("TIME") | ~correct | (inner["size"] >= first))
    shifting = bench.state("TURN", "MEAN", "PLACE PRODUCT", "ERROR", "START", "SOLVE", "LIMIT", "CHANGE") & correct
    timed = shifting | bench.state("TURN PRODUCT") & correct
    bench.promise(~timed | (length >= first) & (length <= len(measure)))
    bench.promise(~timed | (inner["e_cut"] == Mux(length > d.mantissa, length - d.mantissa, 0)))
    bench.promise(~shifting | (inner["more"] == length - first))
    # A limit is of no use if the time is cut.
    limiting = shifting & (inner["e_cut"] == 0)
    bench.promise(~limiting | (inner["few"] == length - first) & (inner["halves"] == (length >> 1) - (first >> 1)))


def kalman(bench: Bench, block: wiring.Component) -> None:
    """Promise that the distance from the count is held until it is corrected."""
    lead, most = bench.inner["lead"], block.design.lead.max
    held = bench.state(
        "INNOVATION", "VELOCITY", "ACCELERATION", "CORRECT VELOCITY", "LIMIT VELOCITY", "LIMIT ACCELERATION"
    )
    bench.promise(~held | (lead >= -most) & (lead <= most))


def edge_kalman(bench: Bench, block: wiring.Component) -> None:
    filter_of_edges(bench, block.design)


def count_kalman(bench: Bench, block: wiring.Component) -> None:
    filter_of_edges(bench, block.design.filter, "filter.")


def filter_of_edges(bench: Bench, design: Design, path: str = "") -> None:
    """Promise the ranges of the states of a filter at a path inside the block."""
    v_max = design.params({}).velocity_max
    ranges = {"v": v_max, "line": v_max, "held": v_max, "bound": (0, 2 * v_max)}
    ranges |= {"room": 2 * v_max, "least": (-2 * v_max, 0), "most": (0, 2 * v_max), "fastest": (0, 2 * v_max)}
    bench.within(**{path + name: bound for name, bound in ranges.items()})
