"""What the supervisor promises: the limit, zero in every state but one, and that nothing arms or forgets by itself."""

from amaranth.hdl import Mux, Signal

from hardwall.hdl.axis.supervisor import Supervisor
from hardwall.model.axis.supervisor import ALWAYS, ARMED, LINK, TRIPPED, Design
from hardwall.model.axis.supervisor import REQUIRED as REQUIRED_CAUSES
from stimuli.specs import spec

from .bench import Bench
from .bugs import Bug
from .property import Property

WHERE = "supervisor mhz"
OUT = "Mux(go, Mux(within, ~less, limit), 0)"


def supervisor(bench: Bench) -> Supervisor:
    return bench.block(Supervisor(Design(spec("mhz"))))


def within_the_limit(bench: Bench) -> None:
    block = supervisor(bench)
    limit = bench.past(block.supervisor_force_limit)
    bench.promise((block.driven <= limit) & (block.driven >= -limit))


def magnitude_and_sign(bench: Bench) -> None:
    block = supervisor(bench)
    bench.promise(block.driven == Mux(block.negative, -block.magnitude, block.magnitude))


def zero_but_armed(bench: Bench) -> None:
    block = supervisor(bench)
    bench.promise((block.state == ARMED) | (block.driven == 0))
    bench.promise((block.state == ARMED) | ~block.alive)


def zero_after_enable(bench: Bench) -> None:
    block = supervisor(bench)
    bench.promise(bench.past(block.enable) | (block.driven == 0) & (block.state != ARMED))


def zero_after_a_cause(bench: Bench) -> None:
    block = supervisor(bench)
    stood = bench.past((block.causes & REQUIRED_CAUSES & ALWAYS & ~(1 << LINK)).any() & ~bench.reset)
    bench.promise(~stood | (block.driven == 0) & (block.state == TRIPPED))


def zero_when_the_host_is_silent(bench: Bench) -> None:
    block = supervisor(bench)
    bench.promise(bench.past(block.live) | (block.driven == 0) & (block.state != ARMED))


def zero_when_the_watchdog_has_run_out(bench: Bench) -> None:
    block = supervisor(bench)
    inner, params = bench.inner, block.design.params
    tick = params.pump_clocks * params.tick_turns
    # The clock within the supervisor's tick, which runs freely, and the one of the host's last beat with its word.
    at, after, began = Signal(range(tick)), Signal(range(tick)), Signal(range(tick))
    before, word = Signal.like(block.heartbeat), Signal.like(block.supervisor_watchdog)
    # The whole ticks for which the host has been silent, and whether the supervisor's has turned since.
    silent, turned = Signal(len(word) + 1), Signal()
    bench.m.d.comb += after.eq(Mux(at == tick - 1, 0, at + 1))
    bench.m.d.sync += [at.eq(after), before.eq(block.heartbeat)]
    with bench.m.If(block.heartbeat != before):
        bench.m.d.sync += [silent.eq(0), turned.eq(0), word.eq(block.supervisor_watchdog), began.eq(after)]
    with bench.m.Elif(after == began):
        bench.m.d.sync += [silent.eq(silent + ~silent.all()), turned.eq(0)]
    with bench.m.Elif(after == 0):
        bench.m.d.sync += turned.eq(1)
    bench.within(pump=(0, params.pump_clocks - 1), tick=(0, params.tick_turns - 1), left=(0, word))
    bench.promise(inner["tick"] * params.pump_clocks + inner["pump"] == at)
    bench.promise((inner["last_beat"] == before) & (turned == (at < began)))
    bench.promise((inner["left"] == 0) | (inner["left"] + silent + turned <= word))
    over = bench.past((silent >= word) | bench.reset)
    bench.promise(~over | (block.driven == 0) & (block.state != ARMED))


def armed_by_the_host_alone(bench: Bench) -> None:
    block = supervisor(bench)
    rose = (block.state == ARMED) & (bench.past(block.state) != ARMED)
    asked = bench.past(block.arm & block.live & block.enable & ~bench.reset)
    bench.promise(~rose | asked & bench.past(block.state == 0) & (block.driven == 0))


def forgotten_by_acknowledgement_alone(bench: Bench) -> None:
    block = supervisor(bench)
    lost = (bench.past(block.latched) & ~block.latched).any()
    told = bench.past(block.acknowledge & (block.acknowledged == block.latched))
    bench.promise(~lost | told | bench.past(bench.reset))


PROPERTIES = [
    Property(
        "the drive is within the force limit of one clock ago",
        WHERE,
        within_the_limit,
        depth=2,
        bugs=(Bug(Supervisor._limit, "Mux(lowered, self.supervisor_force_limit, ~missing)", "~missing"),),
        quick=True,
        within=12,
    ),
    Property(
        "the drive's magnitude and sign, which make the pulses, are those of the drive",
        WHERE,
        magnitude_and_sign,
        depth=2,
        bugs=(Bug(Supervisor._limit, "(self.magnitude, self.negative)", "(self.magnitude, self.drive[-1])"),),
        quick=True,
        within=12,
    ),
    Property(
        "the drive and alive are zero in every state but ARMED",
        WHERE,
        zero_but_armed,
        depth=2,
        bugs=(Bug(Supervisor._limit, OUT, "Mux(within, ~less, limit)"),),
        within=12,
    ),
    Property(
        "the drive is zero one clock after enable is low",
        WHERE,
        zero_after_enable,
        depth=2,
        bugs=(Bug(Supervisor.elaborate, "& self.enable & ~self.disarm", "& ~self.disarm"),),
        within=12,
    ),
    Property(
        "the drive is zero one clock after a required cause stands",
        WHERE,
        zero_after_a_cause,
        depth=2,
        bugs=(Bug(Supervisor.elaborate, "self.supervisor_causes | REQUIRED", "self.supervisor_causes"),),
        quick=True,
        within=12,
    ),
    Property(
        "the drive is zero, and nothing is ARMED, one clock after the heartbeat is overdue",
        WHERE,
        zero_when_the_host_is_silent,
        depth=2,
        # A bug in the cause itself shows after the shortest watchdog, 50 ms of clocks: the block's own tests find it.
        bugs=(Bug(Supervisor.elaborate, "self.enable & self.live", "self.enable"),),
        within=12,
    ),
    Property(
        "the drive is zero one clock after the host has been silent for its watchdog, in ticks of 1 ms or just below",
        WHERE,
        zero_when_the_watchdog_has_run_out,
        depth=2,
        bugs=(
            Bug(Supervisor._watch, "left.eq(self.supervisor_watchdog)", "left.eq(self.supervisor_watchdog + 1)"),
            Bug(Supervisor._watch, "(self.heartbeat != last_beat)", "(self.heartbeat != 0)"),
        ),
        within=12,
    ),
    Property(
        "only the host's arm leads to ARMED, from DISARMED, and with a drive of zero",
        WHERE,
        armed_by_the_host_alone,
        depth=2,
        bugs=(Bug(Supervisor.elaborate, "self.arm & ready", "ready"),),
        within=12,
    ),
    Property(
        "a cause is forgotten only when exactly the causes that are latched are acknowledged",
        WHERE,
        forgotten_by_acknowledgement_alone,
        depth=2,
        bugs=(Bug(Supervisor.elaborate, "(self.acknowledged == self.latched)", "(self.acknowledged != 0)"),),
        quick=True,
        within=12,
    ),
]
