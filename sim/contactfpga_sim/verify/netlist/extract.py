"""The netlist of a built board: from an iCE40's bitstream, or as synthesized for an ECP5.

A bidirectional pin becomes an input, an output and an output enable.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

from amaranth.lib.wiring import Out

from contactfpga.boards import pll
from contactfpga.boards.spec import NAME, BoardSpec, bitstream_path
from contactfpga.errors import ContactFPGAError, MissingTool
from contactfpga.skin import Skin, SkinError
from contactfpga_hdl.board import build, synthesis, tools
from contactfpga_hdl.board.board_top import platform_for
from contactfpga_hdl.scan.pins import column_pins, drives_columns_both_ways, row_pins
from contactfpga_sim.model.board import native
from contactfpga_sim.model.board.native import Netlist
from contactfpga_sim.verify.netlist import ecp5_cells


class WrongPins(ContactFPGAError):
    """The netlist lacks one buffer with an output enable for each line."""


def lines(skin: Skin) -> dict[str, int]:
    """Number of lines of each bidirectional pin, by name."""
    sheet = row_pins(skin) | column_pins(skin)
    return {name: sheet[f"{name}_drive"].shape for name in ("rows", "columns") if f"{name}_drive" in sheet}


def of_icebox(chip: str, skin: Skin) -> str:
    """The Verilog of ``icebox_vlog`` with an input ``NAME_0__io`` and outputs ``NAME_0__o`` and ``NAME_0__oe``.

    If a line of a port is never read, such as a guard row, ``icebox_vlog`` makes the port an output.
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
    """:func:`of_icebox` for the Verilog of an ECP5 synthesis."""
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
    return (
        f"assign {_bit(f'{name}_0__o', line, width)} = {level};\n"
        f"assign {_bit(f'{name}_0__oe', line, width)} = {enable};"
    )


def wrapper(skin: Skin) -> tuple[dict[str, str], str]:
    """Connections of the chip's ports that this module adds, and the needed Verilog.

    A column counts as driven only at its proper level: the released one, or of two the first column's; a guard column
    at the other.
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
    hits = list(re.finditer(pattern, text, re.DOTALL))
    if len(hits) != 1:
        raise WrongPins(f"the netlist has {len(hits)} places like {pattern}; expected is one")
    return hits[0]


def _put(text: str, hit: re.Match[str], new: str) -> str:
    return text[: hit.start()] + new + text[hit.end() :]


class WrongBitstream(ContactFPGAError):
    """A bitstream that differs after unpacking and packing, or whose PLL is not set as requested."""


def from_bitstream(board: BoardSpec, skin: Skin, folder: Path) -> Netlist:
    """Build the iCE40 bitstream in ``folder`` and extract its netlist.

    Raises :class:`MissingTool` without ``icebox_vlog`` and :class:`WrongBitstream`.
    """
    _check(skin)
    if shutil.which("icebox_vlog") is None:
        raise MissingTool("a netlist from the bitstream", "icebox_vlog", "sudo apt install fpga-icestorm")
    build.build(skin, board, folder)
    bitstream = bitstream_path(board, folder).name
    _run(folder, tools.tool("yowasp-iceunpack"), bitstream, "unpacked.asc")
    _run(folder, tools.tool("yowasp-icepack"), "unpacked.asc", "packed.bin")
    if (folder / "packed.bin").read_bytes() != (folder / bitstream).read_bytes():
        raise WrongBitstream(
            f"{folder / bitstream}: unpacked and packed again it has other bytes, see packed.bin beside it"
        )
    # The pin constraints name the pins; collected, those of rows and columns are one port each.
    pins = ("-c", "-p", f"{NAME}.pcf")
    chip = _run(folder, "icebox_vlog", "-s", *pins, "-n", NAME, "unpacked.asc")
    if skin.clock_hz != board.clock_hz:
        chip = _without_pll(chip, board, skin)
    return Netlist(
        {"chip.v": of_icebox(chip, skin), "top.v": _pins(board, skin)},
        # The defaults of the cell library's ports are not plain Verilog, and icebox_vlog connects every port.
        "read_verilog -defer -DNO_ICE40_DEFAULT_ASSIGNMENTS +/ice40/cells_sim.v; read_verilog chip.v top.v; "
        "hierarchy -check -top top",
    )


def _check(skin: Skin) -> None:
    if skin.ghosts:
        raise SkinError("diodes is 'none'; rows that float are not simulated from a netlist of pins")


def _without_pll(chip: str, board: BoardSpec, skin: Skin) -> str:
    """Netlist with the PLL's output on the crystal's pin, always locked; its dividers are checked."""
    cell = re.search(r"^SB_PLL40_\w+ #\((.*?)\) \S+ \((.*?)^\);", chip, re.MULTILINE | re.DOTALL)
    if cell is None:
        raise WrongBitstream(f"{board.title}: there is no PLL in the bitstream")
    asked = pll.dividers(board.pll, board.clock_hz, skin.clock_hz)
    found = {name: int(bits, 2) for name, bits in re.findall(r"\.(\w+)\(\d'b([01]+)\)", cell[1]) if name in asked}
    if found != asked:
        raise WrongBitstream(f"{board.title}: the PLL's dividers are {found} in the bitstream, {asked} were asked for")
    nets = dict(re.findall(r"\.(\w+)\((\w+)\)", cell[2]))
    stub = f"assign {nets['PLLOUTGLOBAL']} = {_crystal(board)};\nassign {nets['LOCK']} = 1'b1;"
    return chip[: cell.start()] + stub + chip[cell.end() :]


def synthesized(board: BoardSpec, skin: Skin, folder: Path) -> Netlist:
    """The netlist synthesized for an ECP5, before place and route."""
    _check(skin)
    build.plan_for(board, skin).extract(str(folder))
    native.yosys(f"read_rtlil {NAME}.il; {synthesis.script(board.fpga, NAME)}; write_verilog -noattr chip.v", folder)
    chip = of_ecp5((folder / "chip.v").read_text(), skin)
    return Netlist(
        {"chip.v": chip, "top.v": _pins(board, skin), "cells.v": ecp5_cells.cells()},
        "read_verilog -defer -overwrite +/ecp5/cells_sim.v cells.v; read_verilog chip.v top.v; "
        "hierarchy -check -top top",
    )


def _pins(board: BoardSpec, skin: Skin) -> str:
    sheet = row_pins(skin) | column_pins(skin)
    wires = {_crystal(board): "clk", "uart_0__rx__io": "rx", "uart_0__tx__io": "tx"}
    wires |= {f"{name}_0__io": name for name in ("contact", *board.pins(skin))}
    parted, text = wrapper(skin)
    wires |= parted
    ports = ["input clk", "input rx", "output tx", "output contact", *(["output alive"] if skin.alive else [])]
    for name, member in sheet.items():
        ports.append(f"{'output' if member.flow == Out else 'input'} [{member.shape - 1}:0] {name}")
    return (
        f"module top({', '.join(ports)});\n{text}"
        f"{NAME} chip({', '.join(f'.{port}({name})' for port, name in wires.items())});\n"
        "endmodule\n"
    )


def _crystal(board: BoardSpec) -> str:
    return f"{platform_for(board).default_clk}_0__io"


def _run(folder: Path, *command: str) -> str:
    # In the folder, with relative names: these tools do not see /tmp by its absolute name.
    run = subprocess.run(command, cwd=folder, capture_output=True, text=True, stdin=subprocess.DEVNULL)
    if run.returncode:
        raise build.BitstreamFailed(
            f"{command[0]} failed with status {run.returncode}:\n{(run.stderr or run.stdout)[-2000:]}"
        )
    return run.stdout
