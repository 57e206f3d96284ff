"""Pins that a netlist drives and reads: each becomes what it reads, what it drives, and whether it does.

The sheet's model needs these apart, and the compiled board knows no third level.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from contactfpga.errors import ContactFPGAError
from contactfpga.skin import Skin
from contactfpga_hdl.scan.pins import column_pins, row_pins

Replace = Callable[[re.Match], str]


class WrongPins(ContactFPGAError):
    """The netlist has not one buffer with an output enable for each line."""


def lines(skin: Skin) -> dict[str, int]:
    """How many lines there are under each name of a Skin's pins that are driven and read."""
    sheet = row_pins(skin) | column_pins(skin)
    return {name: sheet[f"{name}_drive"].shape for name in ("rows", "columns") if f"{name}_drive" in sheet}


def of_icebox(chip: str, skin: Skin) -> str:
    """The Verilog of ``icebox_vlog`` with an input ``NAME_0__io`` and outputs ``NAME_0__o`` and ``NAME_0__oe``."""
    for name, width in lines(skin).items():
        port = rf"\{name}_0__io " if width > 1 else f"{name}_0__io"
        size = _size(width)
        chip = _once(chip, rf"inout {re.escape(size + port)}", lambda _, n=name, s=size, p=port: _declared(n, s, p))
        for line in range(width):
            pin = rf"\{name}_0__io[{line}] " if width > 1 else port
            found = rf"assign {re.escape(pin)} *= (\S+) \? (\S+) : 1'bz;"
            chip = _once(chip, found, lambda hit, n=name, at=line, w=width: _driven(n, at, w, hit[2], hit[1]))
    return chip


def of_ecp5(chip: str, skin: Skin) -> str:
    """The same with the Verilog of a synthesis for an ECP5."""
    for name, width in lines(skin).items():
        port, size = f"{name}_0__io", _size(width)
        chip = _once(chip, rf"inout {re.escape(size + port)};", lambda _, n=name, s=size, p=port: _outputs(n, s, p))
        chip = _once(
            chip, rf"(module \w+\(.*?)\b{port}\b", lambda hit, n=name, p=port: f"{hit[1]}{p}, {n}_0__o, {n}_0__oe"
        )
        for line in range(width):
            pin = re.escape(f"{port}[{line}]" if width > 1 else port)
            found = rf'TRELLIS_IO #\(\s*\.DIR\("BIDIR"\)\s*\) \S+ +\(\s*\.B\({pin}\),\s*(.*?)\s*\);'
            chip = _once(chip, found, lambda hit, n=name, at=line, w=width, p=pin: _buffer(hit[1], n, at, w))
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

    A column that is not driven to the released level counts as one that is not driven.
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
            text += f"assign columns_drive = columns_oe & {'' if skin.selects_low else '~'}columns_o;\n"
    return ports, text


def _declared(name: str, size: str, port: str) -> str:
    return f"input {size}{port}, output {size}{name}_0__o, output {size}{name}_0__oe"


def _outputs(name: str, size: str, port: str) -> str:
    return f"input {size}{port};\n  output {size}{name}_0__o;\n  output {size}{name}_0__oe;"


def _size(width: int) -> str:
    return f"[{width - 1}:0] " if width > 1 else ""


def _bit(name: str, line: int, width: int) -> str:
    return f"{name}[{line}]" if width > 1 else name


def _once(text: str, pattern: str, replace: Replace) -> str:
    changed, count = re.subn(pattern, replace, text, flags=re.DOTALL)
    if count != 1:
        raise WrongPins(f"the netlist has {count} places like {pattern}; expected is one")
    return changed
