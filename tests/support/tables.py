"""What the tables of ports say, and what Verilog declares."""

import re

from hardwall.hdl.ports import COLUMNS


def rows(table: str) -> list[dict[str, str]]:
    """Return the rows of a Markdown table, with their cells by column."""
    lines = [[cell.strip() for cell in line.strip("|\n").split(" | ")] for line in table.splitlines()]
    assert tuple(lines[0]) == COLUMNS
    assert set(lines[1]) == {"---"}
    return [dict(zip(COLUMNS, line, strict=True)) for line in lines[2:]]


def verilog_ports(text: str, module: str) -> dict[str, tuple[str, int]]:
    """Return direction and width of every port of a module, by name."""
    names, body = re.search(rf"^module {module}\((.*?)\);(.*?)^endmodule", text, re.S | re.M).groups()
    declared = re.findall(r"^  (input|output) (?:\[(\d+):0\] )?(\S+?) ?;", body, re.M)
    ports = {name.lstrip("\\"): (way.removesuffix("put"), int(top or 0) + 1) for way, top, name in declared}
    assert sorted(ports) == sorted(name.strip().lstrip("\\") for name in names.split(","))
    return ports
