"""What the supervisor promises: the limit, zero in every state but one, and that nothing arms or forgets by itself."""

from amaranth.hdl import Mux

from hardwall.hdl.supervisor import Supervisor
from hardwall.model.supervisor import ALWAYS, ARMED, LINK, TRIPPED, Design
from hardwall.model.supervisor import REQUIRED as REQUIRED_CAUSES
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
