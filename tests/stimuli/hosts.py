"""Hosts for tests of the supervisor: they look at its model, and give its inputs at every clock."""

import random as plain

from hardwall.model.axis import supervisor
from hardwall.model.axis.supervisor import ALL, CAUSES, DISARMED, LINK, START, TRIPPED, Inputs
from hardwall.testing import SEED


def settled(d: supervisor.Design, **changed: int) -> Inputs:
    """Return inputs with every word as after reset, the loops closed and nothing asked."""
    return Inputs(enable=1, **{word.name: word.reset for word in d.words})._replace(**changed)


class Host:
    """A host that looks at the model: the inputs that it gave at every clock."""

    def __init__(self, design: supervisor.Design):
        self.design, self.random, self.state = design, plain.Random(SEED), START
        self.inputs, self.rows = settled(self.design), []

    def clock(self, reset: int = 0, **pulses: int) -> None:
        """Give the inputs that are held and some pulses, with any stamp and a drive that may be at its limit."""
        d, random = self.design, self.random
        drive = random.randint(d.force.min, d.force.max) >> random.randrange(d.force.width)
        if random.random() < 0.3:
            # At the limit, and one beside it.
            limit = min(self.state.ceiling >> d.params.ramp_fraction, self.inputs.supervisor_force_limit)
            drive = random.choice((-1, 1)) * (limit + random.randint(-1, 1))
        now = self.inputs._replace(
            strobe=int(random.random() < 0.3), drive=drive, stamp=random.getrandbits(d.stamp_width), **pulses
        )
        self.rows.append((reset, *now))
        self.state = START if reset else supervisor.step(d.params, self.state, now)

    def is_interrupted(self, clocks: int) -> None:
        """Arm, beat and err for so many clocks, at random."""
        d, random, beating = self.design, self.random, True
        largest = {word.name: word.format.max for word in d.words}
        for _ in range(clocks):
            act, pulses = random.random(), {}
            if act < 0.02 and self.state.state == DISARMED:
                pulses = {"arm": 1}
            elif act < 0.02 and self.state.state == TRIPPED:
                wrong = 1 << random.randrange(len(CAUSES)) if random.random() < 0.3 else 0
                pulses = {"acknowledge": 1, "acknowledged": self.state.latched ^ wrong}
            elif act < 0.03:
                word = random.choice(d.words).name
                top = largest[word] >> random.randrange(largest[word].bit_length())
                self.inputs = self.inputs._replace(**{word: random.randint(0, top)})
            elif act < 0.032:
                loops = {"enable": int(random.random() < 0.8), "referenced": random.randrange(2)}
                self.inputs = settled(d, heartbeat=self.inputs.heartbeat, **loops)
                beating = random.random() < 0.7
            elif act < 0.033:
                pulses = {random.choice(("arm", "disarm", "acknowledge")): 1}
            elif act < 0.036:
                more = random.randrange(ALL) if random.random() < 0.1 else 0
                pulses = {"causes": 1 << random.randrange(len(CAUSES)) | more}
            elif act < 0.05 and beating:
                self.inputs = self.inputs._replace(heartbeat=random.randrange(1 << 16))
            self.clock(int(random.random() < 1e-4), **pulses)

    def trips(self, bit: int, times: int) -> None:
        """Arm, and be tripped by one cause, so many times; the host makes its own by silence."""
        for _ in range(times):
            self.inputs = settled(self.design, heartbeat=self.inputs.heartbeat ^ 1, supervisor_causes=ALL)
            self.inputs = self.inputs._replace(supervisor_watchdog=1)
            self.clock(acknowledge=1, acknowledged=self.state.latched)
            self.clock(arm=1)
            self.waits(int(bit == LINK))
            self.clock(causes=1 << bit)

    def is_silent(self, ticks: int) -> None:
        """Beat once, with so many milliseconds to the next beat, which comes one too late."""
        self.inputs = settled(self.design, heartbeat=self.inputs.heartbeat ^ 1, supervisor_watchdog=ticks)
        self.clock()
        self.waits(ticks + 1)

    def waits(self, ticks: int) -> None:
        """Do nothing for so many milliseconds."""
        for _ in range(ticks * self.design.params.pump_clocks * self.design.params.tick_turns):
            self.clock()
