"""The texts of a register map: every register is in each, and a C compiler reads the header."""

import json
import subprocess

from hardwall.model import register_texts
from hardwall.model.axes.registers import AxesMap
from hardwall.model.axis import supervisor
from hardwall.model.axis.registers import MAP
from stimuli.supervised import CAPTURE_REGISTERS, supervised
from stimuli.supervised_axes_world import slow

REGISTERS = supervised("mhz")


def test_the_page_has_every_register():
    page = register_texts.markdown(REGISTERS)
    rows = [line.split(" | ") for line in page.splitlines() if line.startswith("| 0x")]
    registers = REGISTERS.registers
    assert [(row[0][2:], row[1]) for row in rows] == [(f"0x{r.address:04X}", f"`{r.name}`") for r in registers]
    assert REGISTERS.identity in page
    assert f"{CAPTURE_REGISTERS} registers begins at 0x8000" in page


def test_the_json_has_every_register():
    described = json.loads(register_texts.as_json(REGISTERS))
    assert [(row["name"], row["address"]) for row in described["registers"]] == [
        (register.name, register.address) for register in REGISTERS.registers
    ]
    assert described["map_address"] == MAP
    assert described["identity"] == REGISTERS.identity


def test_a_compiler_reads_the_header(tmp_path):
    (tmp_path / "registers.h").write_text(register_texts.c_header(REGISTERS), encoding="ascii")
    names = [register.name.upper() for register in REGISTERS.registers]
    prints = "".join(f'printf("%d\\n", HARDWALL_{name});' for name in names)
    includes = '#include <stdio.h>\n#include "registers.h"\n'
    source = f"{includes}int main(void) {{ {prints} return HARDWALL_LAYOUT_LSB != 1.0; }}"
    (tmp_path / "main.c").write_text(source, encoding="ascii")
    subprocess.run(["c++", "-Wall", "-Werror", "-x", "c++", "main.c", "-o", "main"], cwd=tmp_path, check=True)
    done = subprocess.run(["./main"], cwd=tmp_path, check=True, capture_output=True, text=True)
    assert [int(line) for line in done.stdout.split()] == [register.address for register in REGISTERS.registers]


def test_a_c_program_reads_negative_values_and_knows_causes_and_states(tmp_path):
    """As a host of one's own does: two registers to a number, and a word of causes to their names."""
    (tmp_path / "registers.h").write_text(register_texts.c_header(REGISTERS), encoding="ascii")
    position = REGISTERS["wall_position"]
    high, low = position.to_registers(-3)
    names = [register for register in REGISTERS.registers if register.format.signed]
    unsigned = [register for register in REGISTERS.registers if not register.format.signed]
    all_of = " && ".join(f"HARDWALL_{each.name.upper()}_SIGNED" for each in names)
    none_of = " || ".join(f"HARDWALL_{each.name.upper()}_SIGNED" for each in unsigned)
    source = f"""
        #include <stdint.h>
        #include <stdio.h>
        #include "registers.h"
        int main(void) {{
            int32_t position = (int32_t)((uint32_t){high} << 16 | {low});
            printf("%d %d %d\\n", position, {all_of}, {none_of});
            printf("%d %d %d\\n", HARDWALL_STATE_DISARMED, HARDWALL_STATE_ARMED, HARDWALL_STATE_TRIPPED);
            printf("%d %d\\n", HARDWALL_CAUSE_ENCODER_ILLEGAL, HARDWALL_CAUSE_EMERGENCY_STOP);
            printf("%d %d\\n", HARDWALL_CAPTURE_STATE_DONE, HARDWALL_CAPTURE_SOURCE_FALL);
            return 0;
        }}
    """
    (tmp_path / "main.c").write_text(source, encoding="ascii")
    subprocess.run(["c++", "-Wall", "-Werror", "-x", "c++", "main.c", "-o", "main"], cwd=tmp_path, check=True)
    done = subprocess.run(["./main"], cwd=tmp_path, check=True, capture_output=True, text=True)
    causes = [1 << supervisor.names(supervisor.ALL).index(name) for name in ("encoder_illegal", "emergency_stop")]
    assert done.stdout.split() == list(map(str, [-3, 1, 0, 0, 1, 2, *causes, 4, 8]))


def test_every_cause_and_flag_has_its_mask():
    header = register_texts.c_header(REGISTERS).splitlines()
    for kind, names in (("CAUSE", supervisor.names(supervisor.ALL)), ("FLAG", REGISTERS.spec.design.flags)):
        for bit, name in enumerate(names):
            assert f"#define HARDWALL_{kind}_{name.upper()} 0x{1 << bit:X}" in header
    # No name is defined twice.
    defined = [line.split()[1] for line in header if line.startswith("#define ")]
    assert len(defined) == len(set(defined))
    assert "two's complement" in register_texts.markdown(REGISTERS)


def test_the_texts_of_several_axes_say_where_their_banks_are():
    registers = AxesMap(slow(3, "fdm"))
    page = register_texts.markdown(registers)
    assert "those of axis k are k times 0x0100 above them, for 3 axes in all" in page
    assert "`heartbeat`, `supervisor_watchdog`" in page
    header = register_texts.c_header(registers).splitlines()
    assert {"#define HARDWALL_AXES 3", "#define HARDWALL_BANK 0x0100"} <= set(header)
    described = json.loads(register_texts.as_json(registers))
    assert (described["banks"], described["bank"]) == (3, 256)
    assert "banks" not in json.loads(register_texts.as_json(REGISTERS))
