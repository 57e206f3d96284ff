"""Pins that a netlist drives and reads: each becomes what it reads, what it drives, and whether it does.

The sheet's model needs these apart, and the compiled board knows no third level.
"""

from __future__ import annotations

import re

from contactfpga.errors import ContactFPGAError
from contactfpga.skin import Skin
from contactfpga_hdl.scan.pins import column_pins, drives_columns_both_ways, row_pins


class WrongPins(ContactFPGAError):
    """The netlist has not one buffer with an output enable for each line."""


def lines(skin: Skin) -> dict[str, int]:
    """How many lines there are under each name of a Skin's pins that are driven and read."""
    sheet = row_pins(skin) | column_pins(skin)
    return {name: sheet[f"{name}_drive"].shape for name in ("rows", "columns") if f"{name}_drive" in sheet}


def of_icebox(chip: str, skin: Skin) -> str:
    """The Verilog of ``icebox_vlog`` with an input ``NAME_0__io`` and outputs ``NAME_0__o`` and ``NAME_0__oe``.

    Where a line of a port is never read, as a guard row is not, ``icebox_vlog`` makes the port an output.
    """
    for name, width in lines(skin).items():
        port = rf"\{name}_0__io " if width > 1 else f"{name}_0__io"
        size = _size(width)
        declared = f"input {size}{port}, output {size}{name}_0__o, output {size}{name}_0__oe"
        chip = _put(chip, _once(chip, f"(?:inout|output) {re.escape(size + port)}"), declared)
        for line in range(width):
            pin = rf"\{name}_0__io[{line}] " if width > 1 else port
            chip = chip.replace(f"assign {port}[{line}] = {pin};", f"assign {pin} = {port}[{line}];")
            hit = _once(chip, rf"assign {re.escape(pin)} *= (\S+) \? (\S+) : 1'bz;")
            chip = _put(chip, hit, _driven(name, line, width, level=hit[2], enable=hit[1]))
    return chip


def of_ecp5(chip: str, skin: Skin) -> str:
    """The same with the Verilog of a synthesis for an ECP5."""
    for name, width in lines(skin).items():
        port, size = f"{name}_0__io", _size(width)
        declared = f"input {size}{port};\n  output {size}{name}_0__o;\n  output {size}{name}_0__oe;"
        chip = _put(chip, _once(chip, f"inout {re.escape(size + port)};"), declared)
        hit = _once(chip, rf"(module \w+\([^)]*?)\b{port}\b")
        chip = _put(chip, hit, f"{hit[1]}{port}, {name}_0__o, {name}_0__oe")
        for line in range(width):
            pin = re.escape(_bit(port, line, width))
            hit = _once(chip, rf'TRELLIS_IO #\(\s*\.DIR\("BIDIR"\)\s*\) \S+ +\(\s*\.B\({pin}\),\s*(.*?)\s*\);')
            chip = _put(chip, hit, _buffer(hit[1], name, line, width))
    return chip


def _buffer(connections: str, name: str, line: int, width: int) -> str:
    nets = dict(re.findall(r"\.(\w)\((.*?)\),?$", connections, re.MULTILINE))
    read = f"assign {nets['O']} = {_bit(f'{name}_0__io', line, width)};\n" if "O" in nets else ""
    return read + _driven(name, line, width, nets["I"], f"~{nets['T']}")


def _driven(name: str, line: int, width: int, level: str, enable: str) -> str:
    """Assignments to a line's two outputs."""
    return (
        f"assign {_bit(f'{name}_0__o', line, width)} = {level};\n"
        f"assign {_bit(f'{name}_0__oe', line, width)} = {enable};"
    )


def wrapper(skin: Skin) -> tuple[dict[str, str], str]:
    """For each port of the chip that this module makes what it is connected to, and the Verilog that this needs.

    A column counts as driven only if it is driven to the level that it should have: the released one, or where columns
    are driven both ways that of the first column, and the guard column the other one.
    """
    ports: dict[str, str] = {}
    text = ""
    for name, width in lines(skin).items():
        reads = "rows_read" if name == "rows" else "columns"
        ports |= {f"{name}_0__io": reads, f"{name}_0__o": f"{name}_o", f"{name}_0__oe": f"{name}_oe"}
        text += f"wire {_size(width)}{name}_o, {name}_oe;\n"
        if name == "rows":
            text += "assign rows = rows_o;\nassign rows_drive = rows_oe;\n"
        else:
            text += _columns(skin, width)
    return ports, text


def _columns(skin: Skin, width: int) -> str:
    if not drives_columns_both_ways(skin):
        return f"assign columns_drive = columns_oe & {'' if skin.selects_low else '~'}columns_o;\n"
    level = f"{{{skin.columns}{{columns_level}}}}"
    wanted = f"{{~columns_level, {level}}}" if skin.guard else level
    return (
        f"assign columns_level = {_bit('columns_o', 0, width)};\n"
        f"assign columns_drive = columns_oe & ~(columns_o ^ {wanted});\n"
    )


def _size(width: int) -> str:
    return f"[{width - 1}:0] " if width > 1 else ""


def _bit(name: str, line: int, width: int) -> str:
    return f"{name}[{line}]" if width > 1 else name


def _once(text: str, pattern: str) -> re.Match[str]:
    """The one place of a pattern."""
    hits = list(re.finditer(pattern, text, re.DOTALL))
    if len(hits) != 1:
        raise WrongPins(f"the netlist has {len(hits)} places like {pattern}; expected is one")
    return hits[0]


def _put(text: str, hit: re.Match[str], new: str) -> str:
    return text[: hit.start()] + new + text[hit.end() :]
