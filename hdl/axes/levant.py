"""Levant's first-order sliding-mode differentiator, an axis a clock: its root is a stage for every few bits."""

from amaranth.hdl import C, Cat, Mux, Signal, Value, signed

from hardwall.model.axes.axis import ROOT_BITS
from hardwall.model.estimators.levant import Design

from ..arithmetic.fixed import fits, fitted, negated, shift_floor
from .estimator import Entered, Estimate, held, moved_since
from .pipe import Pipe


def estimate(pipe: Pipe, design: Design, entered: Entered) -> Estimate:
    """Return the estimate of `hardwall.hdl.estimators.levant`, as many stages later as the model's `PIPELINES` says.

    The tracked position is read in the second stage and written in the last: the next sample of the same axis may be
    one stage fewer behind.
    """
    velocity, error = design.velocity, design.error
    lead = pipe.kept("lead", signed(max(error.width, velocity.width) + 1))
    u1 = pipe.kept("u1", signed(velocity.width))

    moved = moved_since(pipe, design, entered)
    at = entered.stage + 1
    tracked = Mux(pipe.later(entered.fresh, 1), 0, lead.read(at))
    distance = pipe.taken(tracked - (moved << velocity.f), "distance")
    within, beyond = held(distance, error)
    e, far = pipe.taken(within[: error.width].as_signed(), "e"), pipe.taken(beyond)
    at += 2

    size = shift_floor(negated(e, e[-1]), velocity.f - design.radicand.f)[: design.radicand.width]
    root, rooted = _root(pipe, pipe.taken(size, "radicand"), at + 1)
    negative, positive = pipe.later(e[-1], rooted - at), pipe.later(e.any() & ~e[-1], rooted - at)
    product = pipe.taken(entered.word(design.words[0].name, rooted) * Cat(C(1, 1), root), "product")
    negative, positive = pipe.taken(negative), pipe.taken(positive)

    stage = rooted + 1
    integral = Mux(pipe.later(entered.fresh, stage - entered.stage), 0, u1.read(stage))
    far_u = pipe.taken(_corrected(integral, product, design.product - velocity.f, negative, positive), "far_u")
    alpha = entered.word(design.words[1].name, stage)
    far_u1 = pipe.taken(integral + Mux(positive, -alpha, Mux(negative, alpha, 0)), "far_u1")

    next_u, next_u1 = fitted(far_u, velocity.width), fitted(far_u1, velocity.width)
    limited = ~fits(far_u, velocity.width) | ~fits(far_u1, velocity.width)
    output = Mux(entered.word(design.words[2].name, stage + 1), next_u1, next_u)
    u = pipe.taken(next_u, "u")
    end = stage + 2
    u1.leave(end, pipe.taken(next_u1, "next_u1"))
    lead.leave(end, pipe.later(e, end - at) + u)
    raised = Cat(pipe.later(far, end - at), pipe.taken(limited))
    return Estimate(pipe.taken(output, "velocity"), raised)


def _corrected(value: Value, product: Value, shift: int, negative: Value, positive: Value) -> Value:
    """Return `value` less the product, plus it or unchanged; the product is shifted by `shift` and rounded half up.

    Rounding and sum are one addition: v - floor(p / 2**s + 1/2) = floor((v 2**s + h - 1 - p) / 2**s), h = 2**s / 2, and
    -1 - p is p's complement.
    """
    if shift < 1:
        product, shift = product << (1 - shift), 1
    step = Cat(product, C(0, 1)).as_signed()
    change = Mux(positive, ~step, Mux(negative, step, 0))
    return (Cat(C(1 << (shift - 1), shift), value).as_signed() + change) >> shift


def _root(pipe: Pipe, radicand: Value, stage: int) -> tuple[Value, int]:
    """Return floor(sqrt(radicand)) of the radicand in that stage, and the stage in which the root is ready."""
    bits = (len(radicand) + 1) // 2
    digits = Cat(radicand, C(0, 2 * bits - len(radicand)))
    remainder, root = C(0, 0), C(0, 0)
    for done in range(bits):
        taken = Cat(digits[-2:], remainder)
        trial = Cat(C(1, 2), root)
        less = Signal(signed(done + 4), name="less")
        pipe.m.d.comb += less.eq(taken - trial)
        # The remainder is at most twice the root so far.
        remainder, root = Mux(less[-1], taken, less)[: done + 2], Cat(~less[-1], root)
        digits = digits[:-2]
        if (done + 1) % ROOT_BITS == 0 or done == bits - 1:
            root, stage = pipe.taken(root, "root"), stage + 1
            if len(digits):
                remainder, digits = pipe.taken(remainder, "remainder"), pipe.taken(digits, "digits")
    return root, stage
