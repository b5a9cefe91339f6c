"""The section `encoder` of a scene: its scale, the errors of its edges, and what happens on its lines.

Errors of place are in counts. All displacements of edges are also summed up in one number for the decoder's limits: the
displacement against neighbouring edges (`error_counts`), and by jitter at a rate of edges (`error_counts_at`).
"""

import math
from functools import cached_property
from typing import Annotated, Literal

from pydantic import Field

from ...model.encoder.quadrature_speed import GLITCH_CLOCKS_MAX
from ..world.encoder import Errors, offsets
from ..world.lines import Lines
from ..world.scale import CUT_SIGMAS, MOST_COUNTS, WAVES, Scale, Wave, cut_of, spread
from .quantities import MARGIN, EdgeError, Length, number, or_none, rounded_down, whole
from .section import Section

ERROR_MAX_COUNTS = 0.5
"""The distance of an edge from its ideal place from which the decoder promises nothing."""
LEAST_CUT_SIGMAS = 2.0
"""The random displacement of edges is cut no nearer than this; otherwise it would not be normal any more."""
EDGE_ERROR_MAX_COUNTS = MOST_COUNTS / LEAST_CUT_SIGMAS
"""The largest sigma of edges that have no other errors."""
TOGETHER_MAX = 1000
"""The most glitches in a sample, or at the same time."""
PERIOD_MAX = 10**9

Counts = number(1e-9, 1e6)
Period = whole(2, PERIOD_MAX)
Phase = number(0.0, 1.0)
Jitter = number(1e-12, 1e-4)
Pulse = number(1e-9, 1e-3)
Emission = number(1e-9, 1e-2)
GlitchRate = number(1e-3, 1e8)
DeadTime = number(0.0, 1e6)
Seed = whole(0, 2**32 - 1)

TOGETHER = {
    "eccentricity_counts": "counts_per_turn",
    "emission_period_s": "edge_separation_s",
    "glitches_hz": "glitch_s",
    "dead": "dead_s",
}
"""Keys that are given together."""


class CycleSection(Section):
    """An error that repeats every so many edges: `error_counts` sin(2 pi (n / `edges` + `phase`)) for edge n."""

    edges: Period
    error_counts: Counts
    phase: Phase = 0.0


class EncoderSection(Section):
    """The scale; without errors its edges are where they should be, and the pins show them as they are passed."""

    count_m: Length
    phase_error_counts: EdgeError | Annotated[list[EdgeError], Field(min_length=4, max_length=4)] = 0.0
    duty_error_counts: EdgeError = 0.0
    edge_error_counts: number(0.0, EDGE_ERROR_MAX_COUNTS) = 0.0
    cycles: Annotated[list[CycleSection], Field(min_length=1, max_length=WAVES - 1)] | None = None
    counts_per_turn: Period | None = None
    eccentricity_counts: Counts | None = None
    eccentricity_phase: Phase = 0.0
    hysteresis_counts: number(0.0, 100.0) = 0.0
    jitter_s: or_none(Jitter) = 0.0
    emission_period_s: Emission | None = None
    emission_phase: Phase = 0.0
    edge_separation_s: Emission | None = None
    glitches_hz: GlitchRate | None = None
    glitch_s: Pulse | None = None
    dead: Literal["a", "b", "both"] | None = None
    dead_s: DeadTime | None = None
    seed: Seed = 1

    @cached_property
    def offsets(self) -> tuple[float, float, float, float]:
        """The distances of the four kinds of edges from their ideal positions, counts."""
        return offsets(self.phase_error_counts, self.duty_error_counts)

    @property
    def waves(self) -> list[Wave]:
        """The errors that repeat along the scale."""
        found = [Wave(cycle.edges, cycle.error_counts, cycle.phase) for cycle in self.cycles or []]
        if self.eccentricity_counts is not None:
            found.append(Wave(self.counts_per_turn, self.eccentricity_counts, self.eccentricity_phase))
        return found

    @property
    def _known_counts(self) -> float:
        """How far all errors but the random one move edges against their neighbours, counts."""
        return max(map(abs, self.offsets)) + sum(map(spread, self.waves))

    @property
    def cut_counts(self) -> float:
        """The largest random displacement of an edge, counts."""
        return cut_of(self.edge_error_counts, self._known_counts) if self.edge_error_counts else 0.0

    @property
    def error_counts(self) -> float:
        """How far edges may be moved against their neighbours: the least distance of two is 1 less twice that."""
        return self._known_counts + self.cut_counts

    def error_counts_at(self, edges_hz: float) -> float:
        """Return the same with the jitter, which moves an edge by up to 4 sigma, at a rate of edges."""
        return self.error_counts + CUT_SIGMAS * self.jitter_s * edges_hz

    def glitch_clocks_max(self, clock_hz: float) -> int:
        """Return the longest glitch filter that the levels of a burst leave, two separations long."""
        if not self.edge_separation_s:
            return GLITCH_CLOCKS_MAX
        return max(math.floor(2 * self.edge_separation_s * clock_hz * MARGIN) - 1, 0)

    @property
    def closest_counts(self) -> float:
        """The least distance of two edges, counts."""
        gaps = [1 + self.offsets[(kind + 1) % 4] - self.offsets[kind] for kind in range(4)]
        return min(gaps) - 2 * (self.error_counts - max(map(abs, self.offsets)))

    @property
    def depends_on_the_way(self) -> bool:
        """Whether the pins differ from the handle's place: by hysteresis, or by effects in time."""
        return self.hysteresis_counts > 0 or self.errors.lines is not None

    @cached_property
    def errors(self) -> Errors:
        """The errors as the world takes them; parts of them that are absent are None."""
        scale = lines = None
        if self.edge_error_counts or self.waves or self.hysteresis_counts:
            waves = (*self.waves, *[Wave()] * WAVES)[:WAVES]
            scale = Scale(self.edge_error_counts, self.cut_counts, waves, self.hysteresis_counts, self.seed)
        if self.jitter_s or self.emission_period_s or self.glitches_hz or self.dead:
            dead_a_s, dead_b_s = (self.dead_s if self.dead in (line, "both") else math.inf for line in "ab")
            gap_s = 1 / self.glitches_hz if self.glitches_hz else math.inf
            late_s = CUT_SIGMAS * self.jitter_s
            emission = self.emission_period_s or 0.0, self.emission_phase, self.edge_separation_s or 0.0
            glitches = gap_s, self.glitch_s or 0.0
            lines = Lines(self.jitter_s, late_s, *emission, *glitches, dead_a_s, dead_b_s, self.seed)
        return Errors(self.offsets, scale, lines)

    def check(self) -> None:
        """Raise ValueError for keys that contradict each other; the message begins with the key."""
        for one, other in TOGETHER.items():
            for given, lacking in ((one, other), (other, one)):
                if getattr(self, given) is not None and getattr(self, lacking) is None:
                    raise ValueError(f"encoder.{lacking} is missing, which encoder.{given} needs")
        if self.emission_period_s and self.edge_separation_s > self.emission_period_s:
            raise ValueError(
                f"encoder.edge_separation_s must be at most emission_period_s, {self.emission_period_s:g}, "
                f"not {self.edge_separation_s!r}"
            )
        try:
            known = self._known_counts
        except ValueError as error:
            raise ValueError(f"encoder.{error}") from None
        if not known < ERROR_MAX_COUNTS:
            keys = "phase_error_counts and duty_error_counts must move each edge"
            if self.waves:
                keys = "phase_error_counts, duty_error_counts, cycles and eccentricity_counts must move each edge"
                keys += " against its neighbours"
            raise ValueError(f"encoder.{keys} by less than {ERROR_MAX_COUNTS:g} counts, not {known:g}")
        largest = max((MOST_COUNTS - known) / LEAST_CUT_SIGMAS, 0.0)
        if not self.edge_error_counts <= largest * MARGIN:
            raise ValueError(
                f"encoder.edge_error_counts must be at most {rounded_down(largest)}, for with the other errors of the "
                f"encoder edges could come too close, not {self.edge_error_counts!r}"
            )

    def check_at(self, edges_hz: float, sample_hz: float) -> None:
        """Raise ValueError for what is too much in time, at the largest rate of edges and the sample rate."""
        if self.jitter_s and not self.error_counts_at(edges_hz) < ERROR_MAX_COUNTS:
            most_s = (ERROR_MAX_COUNTS - self.error_counts) / CUT_SIGMAS / edges_hz
            raise ValueError(
                f"encoder.jitter_s must be less than {most_s:.4g}: at controller.speed_max_m_per_s, "
                f"{edges_hz * self.count_m:g}, 4 sigma would move an edge over its neighbour, not {self.jitter_s!r}"
            )
        if self.emission_period_s and self.edge_separation_s * edges_hz > MARGIN:
            raise ValueError(
                f"encoder.edge_separation_s must be at most {rounded_down(1 / edges_hz)}: edges come so often at "
                f"controller.speed_max_m_per_s, {edges_hz * self.count_m:g}, not {self.edge_separation_s!r}"
            )
        if self.glitches_hz:
            most_hz = TOGETHER_MAX / max(1 / sample_hz, self.glitch_s)
            if self.glitches_hz > most_hz * MARGIN:
                raise ValueError(
                    f"encoder.glitches_hz must be at most {rounded_down(most_hz)}, {TOGETHER_MAX} in a sample or at "
                    f"the same time, not {self.glitches_hz!r}"
                )
