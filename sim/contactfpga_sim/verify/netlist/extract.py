"""The netlist of a built board: taken back out of an iCE40's bitstream, or as synthesized for an ECP5."""

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
from contactfpga_hdl.scan.pins import column_pins, row_pins
from contactfpga_sim.model.board import native
from contactfpga_sim.model.board.native import Netlist
from contactfpga_sim.verify.netlist import both_ways, ecp5_cells


class WrongBitstream(ContactFPGAError):
    """A bitstream that has other bytes when unpacked and packed again, or that sets its PLL otherwise than asked."""


def from_bitstream(board: BoardSpec, skin: Skin, folder: Path) -> Netlist:
    """Build the iCE40 bitstream in ``folder`` and take the netlist back out of its bytes.

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
        {"chip.v": both_ways.of_icebox(chip, skin), "top.v": _pins(board, skin)},
        # The defaults of the cell library's ports are not plain Verilog, and icebox_vlog connects every port.
        "read_verilog -defer -DNO_ICE40_DEFAULT_ASSIGNMENTS +/ice40/cells_sim.v; read_verilog chip.v top.v; "
        "hierarchy -check -top top",
    )


def _check(skin: Skin) -> None:
    if skin.ghosts:
        raise SkinError("diodes is 'none'; rows that float are not simulated from a netlist of pins")


def _without_pll(chip: str, board: BoardSpec, skin: Skin) -> str:
    """The netlist with the PLL's output net on the crystal's pin, and always locked; its dividers are compared."""
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
    """Synthesize for an ECP5: the cells that place and route starts from, without their places."""
    _check(skin)
    build.plan_for(board, skin).extract(str(folder))
    native.yosys(f"read_rtlil {NAME}.il; {synthesis.script(board.fpga, NAME)}; write_verilog -noattr chip.v", folder)
    chip = both_ways.of_ecp5((folder / "chip.v").read_text(), skin)
    return Netlist(
        {"chip.v": chip, "top.v": _pins(board, skin), "cells.v": ecp5_cells.cells()},
        "read_verilog -defer -overwrite +/ecp5/cells_sim.v cells.v; read_verilog chip.v top.v; "
        "hierarchy -check -top top",
    )


def _pins(board: BoardSpec, skin: Skin) -> str:
    """Verilog that gives the pins, which are named after the platform's resources, the names of the gateware's."""
    sheet = row_pins(skin) | column_pins(skin)
    wires = {_crystal(board): "clk", "uart_0__rx__io": "rx", "uart_0__tx__io": "tx"}
    wires |= {f"{name}_0__io": name for name in ("contact", *board.pins(skin))}
    parted, text = both_ways.wrapper(skin)
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
