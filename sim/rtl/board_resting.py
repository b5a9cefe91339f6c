"""What runs in a board while it rests: a check of its netlist, so that the simulation of a virtual board skips clocks.

A board rests as an axis does, see `resting`, but for three parts that no clock leaves as they were:

- **Comparisons that take turns.** The limits of the position share one comparator. So a board rests in two clocks: each
  state comes again behind the next. A register with the two lowest bits of a counter shows that it has taken it.
- **The monitor of the clock.** Its registers, and the beat that it watches, follow from nothing but each other and the
  two clocks. So they run through the same states again and again. What the rest of the board sees of them, `EXITS`, has
  to be constant in all these states.
- **The sum of the pulses**, which every clock adds its amount to. It reaches nothing but its pin, through a gate.

A **guard** is a signal that must be low while the board rests. It stands for the shift register of the host's words,
which mixes a stamp with other words, bit by bit, where a host reads: that is computed, not taken.

**Why that is enough.** Let the inputs be constant, and let no counter be at a stop. Let five states in a row repeat.
The third is like the first, the fourth like the second, and the fifth like the third, except that counters are two
further. Every decision of the third and the fourth clock then depends on the same values as two clocks before. So
each register takes its value by the same way as then. It cannot be the way from a counter: the second lowest bit of a
counter differs from its value two clocks before, and the register would, too. Memories are the same in the third
state and in the fifth, though a word may be written again and again. So the sixth state is made as the fourth was,
the seventh as the fifth, and so on, up to a stop or another input. An even number of clocks is skipped, so that the
turn of the comparator is the same.

What Verilator keeps beside registers is not known here. The tests compare it behind each skip with what the clocks
give.
"""

from dataclasses import dataclass

from amaranth.hdl import _nir as nir

from .resting import Counter, NetlistCheck, RestsNotError, extended

COUNTERS = ("stamp", "axis.axis.divider", "axis.supervisor.pump", "link.line.quiet")
"""The registers that may run: the clock's number, the timers of samples and of `alive`, and the line's quiet time."""
MONITOR, SUM, PULSES, PERMITTED = "clock_monitor", "stage.total", "drive_pdm", "stage.permitted"
LOWEST = 2
"""The lowest bits of a counter: two clocks change one of them."""


@dataclass(frozen=True)
class BoardResting:
    """How a board rests.

    Attributes:
        counters: what may run.
        guards: names of the signals that are low while it rests.
        watched: names of the registers that only the monitor of the clock sees, but for its own.
        exits: names of the registers by which the rest of the board sees the monitor.
        sum_bits: the bits of the sum of the pulses, without its carry; 0 for a stage without one.
        memories: names of the memories.
    """

    counters: tuple[Counter, ...]
    guards: tuple[str, ...]
    watched: tuple[tuple[str, ...], ...]
    exits: tuple[tuple[str, ...], ...]
    sum_bits: int
    memories: tuple[str, ...]


def check(netlist: nir.Netlist) -> BoardResting:
    """Return how a board rests.

    Args:
        netlist: the board, from `hdl.export.to_netlist`.

    Raises:
        RestsNotError: if a counter, the monitor of its clock or the sum of its pulses reaches what it must not.
    """
    return _BoardCheck(netlist, COUNTERS).board()


class _BoardCheck(NetlistCheck):
    def board(self) -> BoardResting:
        self._guards: dict[str, None] = {}
        if any(len(counter) < LOWEST for counter in self._counters.values()):
            raise RestsNotError(f"a counter has fewer than {LOWEST} bits")
        self._sum = next((value for value, names in self._names.items() if SUM in names), None)
        sum_bits = len(self._sum) - 1 if self._sum is not None and self._is_sum(self._sum) else 0
        for number, cell in enumerate(self._cells):
            if number == self._sum_cell:
                self._decides(f"the clock of {SUM}", [cell.clk, cell.arst])
            else:
                self._check(number, cell)
            if isinstance(cell, nir.AsyncReadPort):
                raise RestsNotError(f"{self._path(self._cells[cell.memory])} is read without a clock")
            if isinstance(cell, nir.SyncWritePort) and len({*cell.en}) > 1:
                raise RestsNotError(f"{self._name(number)} is written in parts")
        for name, value in self._netlist.top.ports_o.items():
            self._decides(f"the output {name}", value)
        watched, exits = self._monitor()
        memories = tuple(self._path(cell) for cell in self._cells if isinstance(cell, nir.Memory))
        return BoardResting(self._found(with_fixed=False), tuple(self._guards), watched, exits, sum_bits, memories)

    def _path(self, memory: nir.Memory) -> str:
        return ".".join([*self._netlist.modules[memory.module_idx].name[1:], memory.name])

    def _names_of(self, value: nir.Value) -> tuple[str, ...]:
        """Return the names of a register or a signal.

        Raises:
            RestsNotError: if it has none.
        """
        if not (names := tuple(self._names.get(value, ()))):
            raise RestsNotError("a signal that has to be seen has no name")
        return names

    # ---- counters --------------------------------------------------------------------------------------------------

    def _shows(self, made: list[nir.Net]) -> bool:
        plain = {self._plain(net) for net in made}
        return any(plain.issuperset(counter[:LOWEST]) for counter in self._counters.values())

    def _plain(self, net: nir.Net) -> nir.Net:
        """Return the net that a net is, where it is shifted by a constant."""
        cell = self._cells[net.cell if net.is_cell else 0]
        if isinstance(cell, nir.Operator) and cell.operator == "u>>" and nir.Value(cell.inputs[1]).is_const:
            place = net.bit + sum(bit.const << k for k, bit in enumerate(cell.inputs[1]))
            return cell.inputs[0][place] if place < len(cell.inputs[0]) else nir.Net.from_const(0)
        return net

    def _is_successor(self, value: nir.Value, counter: nir.Value) -> bool:
        """Return whether a value is a counter and one, or and a bit that no counter makes."""
        cell = self._cells[value[0].cell if value[0].is_cell else 0]
        if not isinstance(cell, nir.Operator) or cell.operator != "+":
            return False
        sums = nir.Value(nir.Net.from_cell(value[0].cell, bit) for bit in range(len(value)))
        for counted, one in (cell.inputs, cell.inputs[::-1]):
            if value == sums and counted == extended(counter, cell.width) and one[1:].is_const:
                return not any(net.is_const and net.const for net in one[1:]) and one[0] not in self._made
        return False

    def _taken(self, number: int, value: nir.Value) -> None:
        try:
            super()._taken(number, value)
        except RestsNotError:
            # It may be computed from a counter behind a guard, if it is held without.
            data, cell = self._cells[number].data, self._cells[number]
            made_by = self._cells[data[0].cell if data[0].is_cell else 0]
            held = nir.Value(nir.Net.from_cell(number, bit) for bit in range(len(data)))
            if not (isinstance(cell, nir.FlipFlop) and isinstance(made_by, nir.AssignmentList)):
                raise
            if made_by.default != held or len(made_by.assignments) != 1:
                raise
            self._guards[self._guard(made_by.assignments[0].cond)] = None

    def _guard(self, condition: nir.Net) -> str:
        """Return the name of the signal that a condition is, which no counter may make."""
        self._decides("a guard", [condition])
        net = condition
        while (cell := self._cells[net.cell if net.is_cell else 0]) and not self._names.get(nir.Value([net])):
            if isinstance(cell, nir.PriorityMatch) and cell.en == nir.Net.from_const(1) and net.bit == 0:
                net = cell.inputs[0]
            elif isinstance(cell, nir.Matches) and cell.patterns == ("1",):
                net = cell.value[0]
            else:
                break
        for name in self._names_of(nir.Value([net])):
            if "$" not in name:
                return name
        raise RestsNotError("a guard has no name of its own")

    # ---- the sum of the pulses -------------------------------------------------------------------------------------

    _sum: nir.Value | None = None

    @property
    def _sum_cell(self) -> int | None:
        return None if self._sum is None else self._sum[0].cell

    def _is_sum(self, total: nir.Value) -> bool:
        """Return True; see that the sum adds an amount in each clock, and reaches nothing but its pin through a gate.

        Raises:
            RestsNotError: if it does not.
        """
        number = total[0].cell
        made = self._followers(set(total))
        ways = self._ways(number, self._cells[number].data) or []
        sums = [way for way in ways if not way.is_const]
        if len(sums) != 1 or not self._adds(sums[0], total, made):
            raise RestsNotError(f"{SUM} is not the sum of its amounts")
        gates = self._netlist.top.ports_o[PULSES]
        permitted = next(value for value, names in self._names.items() if PERMITTED in names)
        gate = self._cells[gates[0].cell]
        if gate.operator != "&" or {nir.Value(i) for i in gate.inputs} != {nir.Value([total[-1]]), permitted}:
            raise RestsNotError(f"{PULSES} is not the carry of {SUM} behind {PERMITTED}")
        if self._reach(made, {number}, PULSES):
            raise RestsNotError(f"{SUM} reaches more than its pin")
        return True

    def _adds(self, value: nir.Value, total: nir.Value, made: set[nir.Net]) -> bool:
        """Return whether a value is a sum without its carry, and an amount."""
        number = value[0].cell
        cell = self._cells[number]
        if not isinstance(cell, nir.Operator) or cell.operator != "+":
            return False
        kept, bits = extended(total[:-1], cell.width), range(len(total))
        amounts = [b for a, b in (cell.inputs, cell.inputs[::-1]) if a == kept]
        if value != nir.Value(nir.Net.from_cell(number, bit) for bit in bits) or not amounts:
            return False
        return not any(net in made or net in self._made for net in amounts[0])

    # ---- the monitor of the clock ----------------------------------------------------------------------------------

    def _monitor(self) -> tuple[tuple[tuple[str, ...], ...], tuple[tuple[str, ...], ...]]:
        """Return the names of the registers that the monitor watches, and of those by which the rest sees it.

        Raises:
            RestsNotError: if the monitor follows from anything but itself, what it watches, and clocks.
        """
        modules = self._netlist.modules
        own = {
            number
            for number, cell in enumerate(self._cells)
            if isinstance(cell, nir.FlipFlop) and MONITOR in modules[cell.module_idx].name
        }
        group, waiting, seen = set(own), [net for number in own for net in self._cells[number].data], set()
        while waiting:
            net = waiting.pop()
            if net.is_const or net in seen:
                continue
            seen.add(net)
            cell = self._cells[net.cell]
            if net.cell == 0 or isinstance(cell, nir.Memory | nir.SyncReadPort | nir.AsyncReadPort):
                raise RestsNotError("the monitor of the clock follows from more than clocks")
            if isinstance(cell, nir.FlipFlop):
                if net.cell in group:
                    continue
                group.add(net.cell)
                waiting += list(cell.data)
            else:
                waiting += [source for source, _ in cell.comb_edges_to(net.bit)]
        clocks = {(self._cells[number].clk, self._cells[number].clk_edge) for number in group - own}
        for number, cell in enumerate(self._cells):
            if isinstance(cell, nir.FlipFlop | nir.SyncReadPort | nir.SyncWritePort) and number not in group:
                clocks.add((cell.clk, cell.clk_edge))
            if number in group and cell.clk.cell != 0:
                raise RestsNotError("the monitor of the clock has a clock that is made")
        if len(clocks) > 1:
            raise RestsNotError("it has more clocks than the monitor of its clock needs")
        watched = tuple(self._names_of(self._register(number)) for number in sorted(group - own))
        exits = tuple(
            self._names_of(self._register(n))
            for n in sorted(group)
            if self._reach(self._followers(set(self._register(n))), group)
        )
        return watched, exits

    def _register(self, number: int) -> nir.Value:
        return nir.Value(nir.Net.from_cell(number, bit) for bit in range(len(self._cells[number].data)))

    def _reach(self, made: set[nir.Net], group: set[int], pin: str = "") -> bool:
        """Return whether nets reach a register or a memory outside a group, or an output but `pin`."""
        for number, cell in enumerate(self._cells):
            if isinstance(cell, nir.Top):
                ends = [net for name, nets in cell.ports_o.items() if name != pin for net in nets]
            elif isinstance(cell, nir.FlipFlop | nir.SyncReadPort | nir.SyncWritePort) and number not in group:
                ends = list(cell.input_nets())
            else:
                continue
            if any(net in made for net in ends):
                return True
        return False
