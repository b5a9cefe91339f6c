"""An axis clock for clock from the models of its blocks: decoder, estimator, wall, passivity and output stage."""

from collections import defaultdict
from collections.abc import Callable
from operator import attrgetter

from hardwall.model.axis import output, passivity, virtual_mass, wall
from hardwall.model.axis.supervised import FIXED, Design
from hardwall.model.encoder import quadrature
from hardwall.model.estimators.acceleration import Accelerated, acceleration_of
from hardwall.model.estimators.estimate import estimate

PULSES = ("preload", "preload_count", "index_arm", "clear_flags", "origin_shift", "slip")
DECODED = (
    "count", "stepped", "indexed", "illegal", "overspeed", "wrapped", "illegal_count", "index_count", "index_armed",
    "index_latched", "referenced", "stamp", "stamp_a_rise", "stamp_b_rise", "stamp_a_fall", "stamp_b_fall",
)  # fmt: skip
"""Outputs of an axis that are its decoder's, by the same names."""
OWN = "drive", "sampled_count", "velocity", "wall_force", "flags"
OWN_OF, DECODED_OF = attrgetter(*OWN), attrgetter(*DECODED)
NO_PULSES = dict.fromkeys(("sampled", "actuated", "estimated", "saturated", "strobe_busy"), 0)


class AxisTwin:
    """The state of a supervised axis, without what supervises it.

    The blocks have their own benches; the twin adds the clock edge at which their results can be seen.

    Args:
        design: the axis's.

    Attributes:
        clocks: the edges since the reset.
        words: the words of the axis that act now.
        pending: whether words wait for a sample, or for its velocity.
    """

    def __init__(self, design: Design):
        self.supervised, self.spec, self.design = design, design.spec, design.spec.design
        self.period, self.decoder_params = self.spec.clocks_per_sample, self.design.decoder
        self.restarted()

    def restarted(self) -> None:
        """Take the state after a reset."""
        self.clocks = self.restart = 0
        self.words = {word.name: word.reset for word in self.design.words} | self.fixed()
        self.pending = self.begun = False
        self.decoder, (self.estimator, self.passivity, self.output, _) = quadrature.START, self.design.start()
        self.sampled_count = self.velocity = self.acceleration = self.wall_force = self.drive = self.sticky = 0
        self.enabled = 0
        self.due: defaultdict[int, list[Callable[[], None]]] = defaultdict(list)
        self.raised: dict[int, int] = {}
        self.pulses: dict[int, dict[str, int]] = {}

    def fixed(self) -> dict[str, int]:
        """Return the words that no host writes."""
        return {word.name: word.format.max for word in self.design.words if word.name in FIXED}

    @property
    def strobe(self) -> bool:
        """Whether the next edge takes a sample."""
        return self.clocks % self.period == self.period - 1

    def _raised(self) -> int:
        """Return the flags that rise with the next edge; the pins already show them."""
        return self.raised.get(self.clocks, 0)

    @property
    def flags(self) -> int:
        """The flags that the pins show."""
        return self.sticky | self._raised()

    def outputs(self) -> dict[str, int]:
        """Return every output of the axis now, by name."""
        own = dict(zip(OWN, OWN_OF(self), strict=True))
        decoded = dict(zip(DECODED, DECODED_OF(self.decoder), strict=True))
        decoded |= {"edge_kind": self.decoder.edge, "edge_down": self.decoder.down}
        if isinstance(self.design.estimator, Accelerated):
            own["acceleration"] = self.acceleration
        return {**own, **decoded, **NO_PULSES, **self.pulses.get(self.clocks, {}), "commit_pending": int(self.pending)}

    def _sample(self) -> None:
        d, decoder, now = self.design, self.decoder, self.clocks
        params = d.params(self.words)
        self.estimator, velocity, raised = estimate(
            params.estimator, self.estimator, quadrature.seen(decoder), self.restart
        )
        force = wall.render(params.wall, decoder.count, velocity)
        acceleration = 0
        if isinstance(d.estimator, Accelerated):
            acceleration = acceleration_of(params.estimator, self.estimator)
        borne = virtual_mass.borne(params.mass, params.wall, params.estimator, self.estimator, decoder.count, force)
        count, fault, restart = decoder.count, quadrature.fault(decoder), self.restart
        driven: list[int] = []

        def observe() -> None:
            driven.append(self.drive)

        def drive() -> None:
            self.passivity, given, active = passivity.step(
                params.passivity, self.passivity, count, restart, velocity, borne, *driven
            )
            # The output stage slews from the drive, which a low enable has made zero.
            begun = self.output._replace(drive=self.drive)
            self.pulses[self.clocks + 1] = {"sampled": 1, "actuated": int(begun.phase == 0)}
            stage = d.output.params(self.words)
            self.output, limited = output.step(stage, begun, given, self.enabled and not fault)
            self.drive = self.output.drive
            self.raised[self.clocks + 1] = limited << params.output_bit | active << params.passivity_bit

        # A result is seen `latency` edges after the strobe, so its register is loaded at the edge before.
        estimated = now + d.estimator.latency
        walled = estimated + d.wall.latency
        self.due[estimated - 1] += [
            lambda: setattr(self, "velocity", velocity),
            lambda: setattr(self, "acceleration", acceleration),
        ]
        self.due[estimated] += [lambda: setattr(self, "sampled_count", count), observe]
        self.raised[estimated] = fault | raised << params.estimator_bit
        self.pulses[estimated] = {"estimated": 1, "saturated": int(raised != 0)}
        self.due[walled - 1] += [lambda: setattr(self, "wall_force", force)]
        self.due[now + d.latency_to_drive - 1] += [drive]

    def _take_words(self, given: dict[str, int]) -> None:
        """Take the words that wait for the sample that begins, or those of the output stage for its velocity."""
        estimated = "estimated" in self.pulses.get(self.clocks, {})
        begins, ends = self.strobe and self.pending, self.begun and estimated
        late = {word.name for word in self.design.output.words}
        for name in (self.words.keys() & given.keys()) - set(FIXED):
            if (name in late and ends) or (name not in late and begins):
                self.words[name] = given[name]
        self.begun = not estimated if self.begun else begins
        self.pending = bool(given["commit"]) or (self.pending and not ends)

    def advance(self, given: dict[str, int], enabled: int) -> None:
        """Advance by one clock edge, with the inputs just before it and the level of `drive_enable` there."""
        self.sticky = (0 if given["clear_flags"] else self.sticky) | self._raised()
        channels = [given[name] for name in ("encoder_a", "encoder_b", "encoder_z")]
        inputs = quadrature.Inputs(*channels, self.words["encoder_glitch_clocks"], self.words["encoder_invert"])
        if self.pending or given["commit"]:
            self._take_words(given)
        if self.strobe:
            self._sample()
            self.restart = 0
        pulses = quadrature.Strobes(*(given[name] for name in PULSES))
        self.decoder = quadrature.step(self.decoder_params, self.decoder, inputs, pulses)
        self.enabled = enabled
        for act in self.due.pop(self.clocks, ()):
            act()
        if not enabled:
            self.drive = 0
        if given["preload"] or given["origin_shift"]:
            self.restart = 1
        self.clocks += 1
