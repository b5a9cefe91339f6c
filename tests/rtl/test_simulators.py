"""The written Verilog means the same to another simulator, read as Verilog and as SystemVerilog.

Icarus Verilog is not a tool of the project: the tests are skipped where there is no `iverilog`.
"""

import dataclasses
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from amaranth.hdl import Shape
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from hardwall.hdl.axis.axis import Axis
from hardwall.hdl.axis.board import Board
from hardwall.hdl.axis.supervised import LOOPS
from hardwall.hdl.export import to_verilog
from hardwall.hdl.link.link import Link
from hardwall.model.axis.registers import RegisterMap
from hardwall.model.axis.supervisor import REQUIRED
from hardwall.model.link.line import framed
from hardwall.sim.rtl.verilator import LINT_OPTIONS, environment
from hardwall.testing import rng
from stimuli import frames
from stimuli.pins import pins
from stimuli.specs import spec

CLOCK_HZ, BAUD = 12_000_000, 3_000_000
RATES = {"clock_hz": CLOCK_HZ, "sample_hz": 200_000, "actuation_hz": 100_000}
PAUSE = 1500
"""Clocks after a frame to the board, enough for a commit and its answer."""
# Inputs change while the clock is low, and outputs are read before its next rising edge.
BENCH = """
module bench;
  reg clk = 0;
  reg [{inputs}-1:0] stimulus [0:{clocks}-1];
  reg [{inputs}-1:0] driven = 0;
  wire [{outputs}-1:0] seen;
  integer n;
  {top} dut(.clk(clk){connected});
  initial begin
    $readmemh("stimulus.hex", stimulus);
    for (n = 0; n < {clocks}; n = n + 1) begin
      driven = stimulus[n];
      #1 $display("%h", seen);
      clk = 1;
      #1 clk = 0;
    end
    $finish;
  end
endmodule
"""

pytestmark = pytest.mark.skipif(not shutil.which("iverilog"), reason="iverilog is not installed")


def walk(clocks: int, rest: int) -> dict[str, np.ndarray]:
    """Return the pins of an encoder whose handle rests for some clocks, and then goes to and fro; and a reset."""
    when = np.arange(clocks)
    turns = np.cumsum((when % 8 == 0) & (when > rest) & (rng().random(clocks) < 0.5))
    seen = pins(np.abs((turns + 80) % 160 - 80))
    levels = {f"encoder_{channel}": level for channel, level in seen.items()}
    return levels | {"rst": (when >= 3) & (when < 8)}


def axis_stimulus(axis: Axis, clocks: int = 12_000) -> dict[str, np.ndarray]:
    """Return a handle at walls, with words and strobes that change."""
    random, rounds = rng(), -(-clocks // 400)
    columns = {
        word.name: random.integers(word.format.min, word.format.max + 1, rounds).repeat(400)[:clocks]
        for word in axis.spec.design.words
    }
    columns |= {"encoder_glitch_clocks": random.integers(0, 3, rounds).repeat(400)[:clocks]}
    columns |= {"wall_position": random.integers(-60, 60, rounds).repeat(400)[:clocks]}
    strobes = {name: random.random(clocks) < 0.01 for name in ("commit", "index_arm", "clear_flags")}
    columns |= walk(clocks, 0) | strobes | {"drive_enable": random.random(clocks) < 0.999}
    columns["rst"][clocks // 2] = True
    return columns


def board_stimulus(board: Board) -> dict[str, np.ndarray]:
    """Return a host that commits words, arms the axis and reads its state, at a handle that moves."""
    registers = board.registers
    wanted = {
        "supervisor_ramp": registers["supervisor_ramp"].high,
        "wall_stiffness": registers["wall_stiffness"].high // 4,
        "wall_position": 20,
        "encoder_glitch_clocks": 1,
        "commit": 1,
        "supervisor_causes": REQUIRED,
        "heartbeat": 77,
        "arm": 1,
    }
    sent = [frames.write(registers[name].address, registers[name].to_registers(word)) for name, word in wanted.items()]
    sent += [frames.read(registers["drive"].address, 8), bytes([43, 14, 1, 0])]
    line = [1] * 100
    for pdu in sent:
        bits = [bit for byte in framed(b"\1" + pdu) for bit in (0, *(byte >> k & 1 for k in range(8)), 1)]
        line += [bit for bit in bits for _ in range(CLOCK_HZ // BAUD)] + [1] * PAUSE
    line += [1] * 8000
    # Until the words are committed, the filter of the reset takes the motion for too fast.
    columns = walk(len(line), len(line) // 2) | {"uart_rx": np.array(line)}
    complements = {f"encoder_{each}_n": 1 - columns[f"encoder_{each}"] for each in "ab"}
    oscillator = np.arange(len(line)) // 2 % 2
    return columns | complements | {"oscillator": oscillator} | dict.fromkeys(LOOPS, np.ones(len(line)))


def write_bench(component: wiring.Component, top: str, columns: dict[str, np.ndarray], folder: Path) -> dict[str, int]:
    """Write the Verilog, a bench that plays `columns` to it, and them; return the widths of the outputs, in order."""
    ports = {"rst": (True, 1)} | {
        name: (member.flow == In, Shape.cast(member.shape).width)
        for name, member in component.signature.members.items()
        if name != "clk"
    }
    words, connected, ends = [0] * len(columns["rst"]), "", {True: 0, False: 0}
    for name, (is_input, width) in ports.items():
        begin, ends[is_input] = ends[is_input], ends[is_input] + width
        connected += f", .{name}({'driven' if is_input else 'seen'}[{begin} +: {width}])"
        if name in columns:
            mask = (1 << width) - 1
            words = [word | (int(value) & mask) << begin for word, value in zip(words, columns[name], strict=True)]
    sizes = {"inputs": ends[True], "outputs": ends[False], "clocks": len(words)}
    (folder / "stimulus.hex").write_text("".join(f"{word:x}\n" for word in words), encoding="ascii")
    (folder / "bench.v").write_text(BENCH.format(top=top, connected=connected, **sizes), encoding="ascii")
    (folder / f"{top}.v").write_text(to_verilog(component, top), encoding="ascii")
    return {name: width for name, (is_input, width) in ports.items() if not is_input}


def printed(folder: Path, *command: str) -> list[str]:
    """Return what a command prints, as lines of a simulation."""
    done = subprocess.run(command, cwd=folder, env=environment(), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    return [line for line in done.stdout.splitlines() if len(line.split()) == 1]


def verilated(folder: Path, top: str) -> list[str]:
    """Return the outputs of the bench under Verilator."""
    # The bench is not held to the rules for hardware.
    options = [*LINT_OPTIONS, "-Wno-style", "--timescale", "1ns/1ns", "--output-split", "0"]
    # The delays of the bench are coroutines.
    options += ["-CFLAGS", "-O0 -std=gnu++20"]
    printed(folder, "verilator", "--binary", "--timing", *options, "--top-module", "bench", "bench.v", f"{top}.v")
    return printed(folder, "obj_dir/Vbench")


def interpreted(folder: Path, top: str, generation: str) -> list[str]:
    """Return the outputs of the bench under Icarus Verilog, for a generation of the language."""
    printed(folder, "iverilog", f"-g{generation}", "-s", "bench", "-o", f"bench-{generation}", "bench.v", f"{top}.v")
    return printed(folder, "vvp", "-n", f"bench-{generation}")


def column(lines: list[str], widths: dict[str, int], name: str) -> list[int]:
    """Return the values of an output."""
    names = list(widths)
    begin = sum(widths[each] for each in names[: names.index(name)])
    return [int(line, 16) >> begin & ((1 << widths[name]) - 1) for line in lines]


CASES = {
    "axis": (Axis, axis_stimulus, {"drive": 20, "count": 60, "velocity": 40, "flags": 3}),
    "board": (Board, board_stimulus, {"uart_tx": 2, "drive_pdm": 2, "alive": 2, "outputs_enable": 2}),
}


@pytest.mark.parametrize("top", CASES)
def test_other_simulators_compute_the_same(top, tmp_path):
    kind, stimulus, values = CASES[top]
    axis = dataclasses.replace(spec("mhz"), **RATES)
    component = kind(axis) if kind is Axis else kind(axis, Link(RegisterMap(axis), BAUD))
    widths = write_bench(component, top, stimulus(component), tmp_path)
    expected = verilated(tmp_path, top)
    for name, least in values.items():
        assert len(set(column(expected, widths, name))) >= least, name
    for generation in ("2005", "2012"):
        assert interpreted(tmp_path, top, generation) == expected
