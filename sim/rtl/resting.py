"""Counters that run while the rest of a component rests: a check of its netlist, so that a simulation skips clocks.

Between two samples an axis does nothing but count clocks. A simulation that knows so may leave these clocks out, and
add their number to the counters. `check` examines Amaranth's netlist, from which the Verilog is written. It finds
whether this holds for the registers in `COUNTERS`, and their stops: the values at which anything else sees them.

**What is checked.** A counter reaches the rest of the component through nothing but

- comparisons with a constant, its stops: the bit of such a comparison may go anywhere;
- the data of registers behind decisions that are not the counter's (multiplexers, assignments under a condition), as a
  word with its unchanged lowest bit: the latch of a stamp.

Its own next value is, behind such decisions again, its successor, itself, or what is not made of counters. What is
`shown` is not made of counters, and all registers have one clock and no asynchronous reset.

**Why that is enough.** Let the inputs be constant. Let two clocks in a row leave every register and memory as it was,
except the counters, which are one further after each clock. Let no counter be at a stop before, between or after the
two clocks. Every decision then depends on unchanged values. So in both clocks every register takes its value by the
same way. It cannot be the way from a counter: the counter's lowest bit differs in the two clocks, and the register
would, too. So a register's new value is made of unchanged values. And a counter takes its successor: by any other way
it would not be one further after each clock. Then the third clock begins like the second, except for the counters, so
it takes the same paths. So does every clock up to one with a counter at a stop, or with other inputs.

**When one clock is enough.** One clock is enough instead of two under two conditions. No register that leads to the
shown outputs takes a counter by any way. And a counter's own next value is its successor, itself or a constant. If such
a register stays as it was, it stays so in the next clock, too. A counter that is one further has taken its successor,
unless the constant is just that value: so the value below a constant is a stop, too. Other registers need not rest,
because no examined output follows from them.

A simulation has to see these clocks each time; what it then skips is exact. If the check fails, nothing is skipped. It
may keep more than registers from clock to clock, as Verilator does: what follows from them. All of this is compared.
Two values follow from a counter. Its successor differs from clock to clock. The bit of a stop is the same at both ends
of the skipped clocks.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property

from amaranth.hdl import _nir as nir

COUNTERS = ("divider", "decoder.seen__stamp")
"""The registers that may run: the timer of an axis's samples, and the number of the clock."""


class RestsNotError(ValueError):
    """A component's clocks cannot be skipped; the one line of the message names the obstacle."""


@dataclass(frozen=True)
class Counter:
    """A register that may run while all else rests.

    Attributes:
        names: all its names, joined by dots; the names of the modules below the top come first.
        width: its bits; it wraps.
        stops: its values at which anything else sees it.
    """

    names: tuple[str, ...]
    width: int
    stops: tuple[int, ...]


@dataclass(frozen=True)
class Resting:
    """How a component rests.

    Attributes:
        counters: what may run while all else rests.
        clocks: the number of successive clocks in which only the counters may change; the component then rests.
    """

    counters: tuple[Counter, ...]
    clocks: int


def check(netlist: nir.Netlist, shown: Iterable[str], listed: Iterable[str] = COUNTERS) -> Resting:
    """Return the counters of a component that may run while the rest rests, and the test for this rest.

    Args:
        netlist: the component, from `hdl.export.to_netlist`.
        shown: the outputs that are looked at while clocks are skipped.
        listed: names of the counters; missing ones are left out.

    Raises:
        RestsNotError: if a counter reaches what it must not.
    """
    return NetlistCheck(netlist, tuple(listed)).run(tuple(shown))


class NetlistCheck:
    """What a netlist's registers follow from: the counters `listed` reach nothing but what may see them."""

    def __init__(self, netlist: nir.Netlist, listed: tuple[str, ...]):
        self._netlist, self._cells = netlist, netlist.cells
        self._names: dict[nir.Value, list[str]] = {}
        for module in netlist.modules:
            for signal, name in module.signal_names.items():
                self._names.setdefault(netlist.signals[signal], []).append(".".join([*module.name[1:], name]))
        self._counters = {
            value[0].cell: value
            for value, names in self._names.items()
            if set(names) & set(listed) and isinstance(self._cells[value[0].cell], nir.FlipFlop)
        }
        self._stops: dict[int, set[int]] = {number: set() for number in self._counters}
        self._made = self._made_of_counters()
        self._fixed: dict[int, set[int]] = {number: set() for number in self._counters}  # below a constant it takes
        self._loaded = False  # whether a counter takes anything but a constant, itself and its successor

    def run(self, shown: tuple[str, ...]) -> Resting:
        clocks = {(cell.clk, cell.clk_edge) for cell in self._cells if isinstance(cell, nir.FlipFlop)}
        if len(clocks) > 1:
            raise RestsNotError("it has more than one clock")
        for number, cell in enumerate(self._cells):
            self._check(number, cell)
        for name in shown:
            self._decides(f"the output {name}", self._netlist.top.ports_o[name])
        at_once = not (self._loaded or self._latched(shown))
        return Resting(self._found(with_fixed=at_once), 1 if at_once else 2)

    def _found(self, with_fixed: bool) -> tuple[Counter, ...]:
        """Return the counters with their stops, and if asked for with the values below the constants that they take."""
        return tuple(
            Counter(
                tuple(self._names[value]),
                len(value),
                tuple(sorted(self._stops[number] | (self._fixed[number] if with_fixed else set()))),
            )
            for number, value in self._counters.items()
        )

    def _latched(self, shown: tuple[str, ...]) -> bool:
        """Return whether anything that the shown outputs follow from takes a counter."""
        writers: dict[int, list[int]] = {}
        for number, cell in enumerate(self._cells):
            if isinstance(cell, nir.SyncWritePort):
                writers.setdefault(cell.memory, []).append(number)
        seen: set[int] = set()
        waiting = [net.cell for name in shown for net in self._netlist.top.ports_o[name] if net.is_cell]
        while waiting:
            number = waiting.pop()
            if number in seen or number == 0:
                continue
            seen.add(number)
            cell = self._cells[number]
            waiting += [net.cell for net in cell.input_nets() if net.is_cell]
            if isinstance(cell, nir.SyncReadPort | nir.AsyncReadPort):
                waiting += writers.get(cell.memory, [])
        return any(
            isinstance(self._cells[number], nir.FlipFlop | nir.SyncWritePort)
            and number not in self._counters
            and any(net in self._made for net in self._cells[number].data)
            for number in seen
        )

    def _made_of_counters(self) -> set[nir.Net]:
        """Return the nets that follow from counters without a register between, but for the bits of stops."""
        return self._followers({net for value in self._counters.values() for net in value}, self._is_stop)

    def _followers(self, nets: set[nir.Net], ends: Callable[[nir.Cell], bool] = lambda cell: False) -> set[nir.Net]:
        """Return some nets, and those that follow from them without a register between, nor a cell that `ends` it."""
        made, waiting = set(nets), list({net.cell for net in nets})
        while waiting:
            for number in self._users.get(waiting.pop(), ()):
                cell = self._cells[number]
                if isinstance(cell, nir.FlipFlop | nir.SyncReadPort) or ends(cell):
                    continue
                new = {
                    net
                    for net in cell.output_nets(number) - made
                    if any(source in made for source, _ in cell.comb_edges_to(net.bit))
                }
                if new:
                    made |= new
                    waiting.append(number)
        return made

    @cached_property
    def _users(self) -> dict[int, set[int]]:
        """The cells that use an output of a cell, by its number."""
        users: dict[int, set[int]] = {}
        for number, cell in enumerate(self._cells[1:], 1):
            for net in cell.input_nets():
                users.setdefault(net.cell if net.is_cell else 0, set()).add(number)
        return users

    def _is_stop(self, cell: nir.Cell) -> bool:
        """Return whether a cell compares a counter with a constant, which is then one of its stops."""
        if not isinstance(cell, nir.Operator) or cell.operator not in ("==", "!="):
            return False
        for value, other in (cell.inputs, cell.inputs[::-1]):
            for number, counter in self._counters.items():
                if other.is_const and value == extended(counter, len(value)):
                    self._stops[number].add(_constant(other))
                    return True
        return False

    def _check(self, number: int, cell: nir.Cell) -> None:
        """Raise RestsNotError if a cell with a memory takes from a counter what it must not."""
        match cell:
            case nir.FlipFlop():
                if not cell.arst.is_const:
                    raise RestsNotError(f"{self._name(number)} has an asynchronous reset")
                self._decides(f"the clock of {self._name(number)}", [cell.clk])
                (self._next if number in self._counters else self._taken)(number, cell.data)
            case nir.SyncWritePort():
                self._decides(self._name(number), [*cell.addr, *cell.en])
                self._taken(number, cell.data)
            case nir.SyncReadPort():
                self._decides(self._name(number), [*cell.addr, cell.en])
            case nir.Top() | nir.Operator() | nir.Part() | nir.Matches() | nir.PriorityMatch() | nir.AssignmentList():
                pass
            case nir.Memory() | nir.AsyncReadPort():
                pass
            case _:
                raise RestsNotError(f"nothing is known of a cell {type(cell).__name__}")

    def _decides(self, what: str, nets: Iterable[nir.Net]) -> None:
        if any(net in self._made for net in nets):
            raise RestsNotError(f"{what} depends on a counter")

    def _ways(self, number: int, value: nir.Value) -> list[nir.Value] | None:
        """Return the values between which a decision chooses, if all of a value is the output of one; else None."""
        cells = {net.cell if net.is_cell else 0 for net in value}
        cell = self._cells[cells.pop()]
        if cells or not isinstance(cell, nir.Operator | nir.AssignmentList):
            return None
        bits = [net.bit for net in value]
        if isinstance(cell, nir.AssignmentList):
            self._decides(f"what {self._name(number)} takes", [assignment.cond for assignment in cell.assignments])
            ways = [nir.Value(cell.default[bit] for bit in bits)]
            for assignment in cell.assignments:
                end = assignment.start + len(assignment.value)
                inside = [bit - assignment.start for bit in bits if assignment.start <= bit < end]
                if inside and len(inside) < len(bits):
                    return None
                if inside:
                    ways.append(nir.Value(assignment.value[bit] for bit in inside))
            return ways
        if cell.operator != "m":
            return None
        self._decides(f"what {self._name(number)} takes", cell.inputs[0])
        return [nir.Value(way[bit] for bit in bits) for way in cell.inputs[1:]]

    def _taken(self, number: int, value: nir.Value) -> None:
        """Raise RestsNotError unless every way to the data of a register is one that the argument allows."""
        made = [net for net in value if net in self._made]
        if not made or self._shows(made):
            return
        ways = self._ways(number, value)
        if ways is None:
            raise RestsNotError(f"{self._name(number)} takes what is computed from a counter")
        for way in ways:
            self._taken(number, way)

    def _shows(self, made: list[nir.Net]) -> bool:
        """Return whether a register that takes some nets cannot be the same at two clocks that are looked at."""
        return any(counter[0] in made for counter in self._counters.values())

    def _next(self, number: int, value: nir.Value) -> None:
        """Raise RestsNotError unless every way to the next value of a counter is one that the argument allows."""
        counter = self._counters[number]
        if value == counter or self._is_successor(value, counter):
            return
        if value.is_const:
            self._fixed[number].add((_constant(value) - 1) % (1 << len(counter)))
            return
        if not any(net in self._made for net in value):
            self._loaded = True
            return
        ways = self._ways(number, value)
        if ways is None:
            raise RestsNotError(f"{self._name(number)} does not count by one")
        for way in ways:
            self._next(number, way)

    def _is_successor(self, value: nir.Value, counter: nir.Value) -> bool:
        cell = self._cells[value[0].cell if value[0].is_cell else 0]
        if not isinstance(cell, nir.Operator) or cell.operator != "+":
            return False
        one, width = nir.Value.from_const(1, cell.width), len(value)
        sums = nir.Value(nir.Net.from_cell(value[0].cell, bit) for bit in range(width))
        counted = [extended(counter, cell.width), one]
        return value == sums and list(cell.inputs) in (counted, counted[::-1])

    def _name(self, number: int) -> str:
        """Return what a cell with a memory is called."""
        cell = self._cells[number]
        if isinstance(cell, nir.SyncWritePort | nir.SyncReadPort):
            memory = self._cells[cell.memory]
            return ".".join([*self._netlist.modules[memory.module_idx].name[1:], memory.name])
        value = nir.Value(nir.Net.from_cell(number, bit) for bit in range(len(cell.data)))
        return min(self._names.get(value, ["a register"]), key=len)


def extended(value: nir.Value, width: int) -> nir.Value:
    """Return a value with zeros above it, so that it has some bits."""
    return nir.Value([*value, *nir.Value.zeros(max(width - len(value), 0))])


def _constant(value: nir.Value) -> int:
    return sum(net.const << bit for bit, net in enumerate(value))
