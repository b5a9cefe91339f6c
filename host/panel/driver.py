"""The thread that polls a board for all tabs: it has the axis, carries out their wishes, and keeps their samples."""

import math
import threading
import time
from collections import deque
from collections.abc import Callable, Generator
from contextlib import nullcontext
from dataclasses import replace
from types import MappingProxyType
from typing import Any, NamedTuple

from ..axis import Axis
from ..errors import ChangedError, ForeignError, HostError, NotReadyError, PortError
from ..heartbeat import LEASE_S
from ..homing import Homed
from ..status import State
from .knobs import knobs_of
from .pace import Pace
from .recorder import Recorder, Wish
from .register_reader import RegisterReader
from .view import View
from .wishes import DONE_S, Wishes, is_fresh, time_of

LOOK_S = 1 / 60
"""The time between two looks at the board."""
KEPT = 4096
"""Samples that are kept for tabs."""
LATE = "the board did not answer in time: nothing was done"
NO_ANSWER = "no board answers: nothing was done"
LEASE_LOOK_S = 1.0
"""The time between two looks at who holds the lease of a board that is shared."""
SAID_S = 8.0
"""How long it is said why an act had no effect."""


class Sample(NamedTuple):
    """A look at the board: the time of this computer, and what the axis did, in SI units.

    The acceleration is None on a board that has none.
    """

    time_s: float
    position_m: float
    velocity_m_per_s: float
    wall_force_n: float
    force_n: float
    acceleration_m_per_s2: float | None


class Driver:
    """The one user of an axis. Tabs ask, and see; nothing that they call waits for the board.

    A wish has the time at which its person made it, s of time.monotonic. A wish that is `STALE_S` old, or comes while
    no board answers, is dropped with a message. A disarm is done however old it is.

    The tab that armed renews the lease, by `ping`. When it is silent for `LEASE_S`, the board is disarmed. If this
    thread cannot do that, it cannot renew the lease either, and the board trips.

    Args:
        connect: returns an axis; called at the beginning, and again when a tab asks for it.

    Attributes:
        view: what is known of the board.
        registers: reads all registers, while a tab asks for that.

    Raises:
        HostError: if the board cannot be had at the beginning.
    """

    def __init__(self, connect: Callable[[], Axis]):
        self._connect, self.view = connect, View()
        self._wishes, self.registers = Wishes(), RegisterReader()
        self._lock, self._ended = threading.Lock(), threading.Event()
        self._samples: deque[Sample] = deque(maxlen=KEPT)
        self._pings: dict[str, float] = {}
        self._taken, self._renewed_s, self._said_s, self._leased_s = 0, 0.0, 0.0, -math.inf
        self._recorder = Recorder()
        self._homing: Generator[str, None, Homed] | None = None
        self._axis: Axis | None = None
        self._open()
        self._thread = threading.Thread(target=self._run, name="hardwall-panel", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Disarm, and leave the board."""
        self._ended.set()
        self._thread.join()
        if self._axis:
            self._axis.close()
            self._axis = None

    # ---- what tabs call ---------------------------------------------------------------------------------------------

    def samples_since(self, number: int) -> tuple[int, list[Sample]]:
        """Return the number of the next sample, and the kept samples from `number` on."""
        with self._lock:
            new = min(self._taken - number, len(self._samples))
            return self._taken, [self._samples[-place] for place in range(new, 0, -1)]

    def ping(self, tab: str, at_s: float | None = None) -> None:
        """Hear that a tab lives, or lived at a time."""
        self._pings[tab] = max(time_of(at_s), self._pings.get(tab, -math.inf))

    def leave(self, tab: str) -> None:
        """Hear that a tab has gone; if it armed, the board is disarmed."""
        self._pings.pop(tab, None)
        if self.view.holder == tab:
            self.disarm()

    def arm(self, tab: str, at_s: float | None = None) -> None:
        """Arm, for a tab that lives."""
        self._wishes.ask(lambda: self._arm(tab), at_s)

    def disarm(self) -> None:
        """Disarm; any tab may."""
        self._wishes.ask_always(self._disarm)

    def acknowledge(self, latched: int, at_s: float | None = None) -> None:
        """Acknowledge the causes that a tab shows, and no others."""
        self._wishes.ask(lambda: self._acknowledge(latched), at_s)

    def connect(self, at_s: float | None = None) -> None:
        """Open the port again, if the board was lost."""
        self._wishes.ask(self._open_again, at_s, anyway=True)

    def home(self, tab: str, index_m: float, at_s: float | None = None) -> None:
        """Begin to home, until it is done, left, or something else is wanted, or the board is silent."""
        self._wishes.ask(lambda: self._home(tab, index_m), at_s)

    def leave_home(self) -> None:
        """Do not home any more."""
        self._wishes.ask(self._leave_home, anyway=True)

    def record(self, tab: str, wish: Wish, at_s: float | None = None) -> None:
        """Begin a capture, whatever was before."""
        self._wishes.ask(lambda: self._record(tab, wish), at_s)

    def set(self, tab: str, name: str, value: float, at_s: float | None = None) -> None:
        """Write a word, in SI units; of several values that come before they are written the last counts."""
        self._wishes.set(name, tab, value, at_s)

    def refuse(self, why: str) -> None:
        """Say for a while why something is not done."""

        def fails() -> None:
            raise HostError(why)

        self._wishes.ask(fails, anyway=True)

    # ---- the thread -------------------------------------------------------------------------------------------------

    def _run(self) -> None:
        while not self._ended.is_set():
            began = time.monotonic()
            try:
                self._obey()
                self._write()
                if self._axis:
                    self._live(self._axis)
                    self._look(self._axis)
                    self._record_on(self._axis)
                    self.registers.step(self._axis)
                    self._home_on()
            except (PortError, ForeignError, ChangedError) as error:
                self._lose(error)
            except HostError as error:
                self._see(status=None, lost=f"{error}")
                self._leave_late()
            except Exception as error:
                # Whatever it is: a page never shows an old state as if it were of now.
                self._lose(HostError(f"the panel failed: {error!r}"))
            self._ended.wait(max(began + LOOK_S - time.monotonic(), 0.001))

    def _see(self, **changes: Any) -> None:
        self.view = replace(self.view, **changes)

    def _say(self, said: str) -> None:
        self._said_s = time.monotonic()
        self._see(said=said)

    def _obey(self) -> None:
        """Carry out a wish; a refusal is shown for a while."""
        if self.view.said and time.monotonic() - self._said_s > SAID_S:
            self._say("")
        while act := self._wishes.act():
            if self.view.status is None and not act.anyway:
                self._say(NO_ANSWER)
            elif not is_fresh(act.at_s):
                self._say(LATE)
            else:
                self._try(act.do, act.at_s + DONE_S)

    def _try(self, do: Callable[[], None], until_s: float) -> None:
        """Do something; after a time, nothing of it goes out to the board."""
        self._say("")
        try:
            with self._axis.by(until_s) if self._axis else nullcontext():
                do()
        except PortError:
            raise
        except (HostError, ValueError, TypeError) as error:
            self._say(f"{error}")
            if isinstance(error, ForeignError | ChangedError):
                raise

    def _open(self) -> None:
        """Connect, and read what the board uses."""
        self._axis = axis = self._connect()
        names = [knob.name for knob in knobs_of(axis.device)]
        values = {name: axis.get(name) for name in names}
        stamp = axis.device.registers["stamp"]
        self._pace = Pace((stamp.high + 1) * stamp.lsb)
        span_s = self._recorder.spans_s(axis)
        self._see(
            device=axis.device, status=axis.status, connected=True, lost="", holder=None, pace=None, span_s=span_s
        )
        self._keep(values)

    def _open_again(self) -> None:
        if self._axis is None:
            try:
                self._open()
            except (HostError, OSError) as error:
                self._see(lost=f"{error}")

    def _lose(self, error: HostError) -> None:
        """Leave a board that is gone, or is another one."""
        if self._axis:
            self._axis.close()
            self._axis = None
            self._recorder.leave()
            self._leave_late()
        gone = {"status": None, "connected": False, "holder": None, "pace": None, "looks_hz": 0.0}
        self._see(**gone, lost=f"{error}", recording=self._recorder.recording)

    def _leave_late(self) -> None:
        """Give up actions in progress when the board is silent: they would end at a time that nobody expects."""
        self._recorder.leave_trigger()
        self.registers.leave()
        self._see(recording=self._recorder.recording)
        if self._homing:
            self._leave_home()
            self._say("the board did not answer: it is not homed any more")

    def _arm(self, tab: str) -> None:
        if self._axis is None:
            return
        if not self._lives(tab):
            raise NotReadyError("the tab that asks to arm does not answer")
        self._leave_home()
        self._axis.arm()
        self._see(holder=tab)

    def _disarm(self) -> None:
        if self._axis:
            self._axis.disarm()
            self._see(holder=None)

    def _acknowledge(self, latched: int) -> None:
        if self._axis is None:
            return
        trip = self._axis.trip
        if trip is None:
            return
        if trip.latched != latched:
            raise HostError(f"the causes have changed since they were shown: {trip}")
        self._axis.acknowledge(trip)

    def _home(self, tab: str, index_m: float) -> None:
        self._check_holder(tab)
        if self._axis:
            self._homing = self._axis.homing(index_m)

    def _leave_home(self) -> None:
        self._homing = None
        self._see(homing="")

    def _home_on(self) -> None:
        """Go on with homing, if it was begun."""
        if self._homing is None:
            return
        try:
            self._see(homing=next(self._homing))
        except StopIteration as end:
            self._leave_home()
            self._see(moved_m=self.view.moved_m + end.value.moved_m)
            self._say(f"it is homed: the handle is at {1e3 * end.value.position_m:.6g} mm")
        except (NotReadyError, ValueError) as error:
            self._leave_home()
            self._say(f"{error}")

    def _check_holder(self, tab: str) -> None:
        if self.view.holder not in (None, tab):
            raise NotReadyError("another tab armed the board: only that tab may do this")

    def _record(self, tab: str, wish: Wish) -> None:
        self._check_holder(tab)
        if self._axis:
            self._recorder.begin(self._axis, wish)

    def _record_on(self, axis: Axis) -> None:
        """Go on with a capture, if there is one."""
        try:
            self._recorder.step(axis)
        except NotReadyError as error:
            self._say(f"{error}")
        self._see(recording=self._recorder.recording)

    def _write(self) -> None:
        """Write the wishes of the tabs, all at one sample; while a tab holds the board, only its own."""
        words, late = self._wishes.words()
        axis = self._axis if self.view.status else None
        if late or (words and axis is None):
            # What was dropped is not left as it is shown.
            self._keep({})
            self._say(LATE if axis else NO_ANSWER)
        if axis is None:
            return
        values = {name: word.value for name, word in words.items() if self.view.holder in (None, word.tab)}
        if len(values) < len(words):
            self._say("another tab armed the board, and alone may set its words")
        if values:
            until_s = min(words[name].at_s for name in values) + DONE_S
            self._try(lambda: self._set(axis, values), until_s)

    def _set(self, axis: Axis, values: dict[str, float]) -> None:
        try:
            axis.set(**values)
        finally:
            # What was refused is not left as it is shown.
            self._keep({name: axis.get(name) for name in values if name in self.view.values})

    def _keep(self, values: dict[str, float]) -> None:
        kept = {**self.view.values, **values}
        self._see(values=MappingProxyType(kept), revision=self.view.revision + 1)

    def _lives(self, tab: str) -> bool:
        return time.monotonic() - self._pings.get(tab, -LEASE_S) < LEASE_S

    def _live(self, axis: Axis) -> None:
        """Renew the lease for a new ping; disarm when the tab that armed is silent."""
        holder = self.view.holder
        if holder is None:
            return
        if not self._lives(holder):
            self._disarm()
            self._say(f"the tab that armed was silent for {LEASE_S:g} s, so the board is disarmed")
        elif (pinged_s := self._pings[holder]) > self._renewed_s:
            self._renewed_s = pinged_s
            axis.renew()

    def _look(self, axis: Axis) -> None:
        """Read the board."""
        status = axis.status
        now_s = time.monotonic()
        motion = status.position_m, status.velocity_m_per_s
        forces = status.wall_force_n, status.force_n
        with self._lock:
            self._taken += 1
            self._samples.append(Sample(now_s, *motion, *forces, status.acceleration_m_per_s2))
        if now_s - self._leased_s > LEASE_LOOK_S:
            self._leased_s = now_s
            self._look_at_lease(axis)
        holder = self.view.holder if status.state is State.ARMED else None
        self._pace.take(now_s, status.stamp_s)
        measured = {"pace": self._pace.pace, "looks_hz": self._pace.looks_hz}
        self._see(status=status, lost="", holder=holder, **measured)

    def _look_at_lease(self, axis: Axis) -> None:
        """See which program may write to a shared board; a former lease holder may have written words."""
        before, lease = self.view.lease, axis.lease
        if before is not None and lease != before:
            self._keep({name: axis.get(name) for name in self.view.values})
        self._see(lease=lease)
