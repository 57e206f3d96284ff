"""KiCad's check of a board's rules; nothing else here needs KiCad."""

from __future__ import annotations

import re
import subprocess
import tempfile
from pathlib import Path

from contactfpga.design.sheet.parts import SheetError
from contactfpga.errors import MissingTool

PYTHON = "/usr/bin/python3"
"""The system's Python, which has KiCad's module."""
SECONDS = 600

_PROGRAM = """
import sys
import pcbnew
board = pcbnew.LoadBoard(sys.argv[1])
board.BuildConnectivity()
sys.exit(0 if pcbnew.WriteDRCReport(board, sys.argv[2], pcbnew.EDA_UNITS_MILLIMETRES, True) else 1)
"""


def there() -> bool:
    try:
        return subprocess.run([PYTHON, "-c", "import pcbnew"], capture_output=True, timeout=60).returncode == 0
    except OSError:
        return False


def require() -> None:
    """Raise :class:`MissingTool` without KiCad."""
    if not there():
        raise MissingTool("--kicad", "KiCad 6 (its module pcbnew)", "apt install --no-install-recommends kicad")


def findings(board: Path) -> list[str]:
    """KiCad's findings for a .kicad_pcb file. Raises :class:`MissingTool` without KiCad and :class:`SheetError` for an
    unreadable file."""
    require()
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.txt"
        done = subprocess.run(
            [PYTHON, "-c", _PROGRAM, str(board), str(report)], capture_output=True, text=True, timeout=SECONDS
        )
        if done.returncode or not report.exists():
            raise SheetError(f"KiCad cannot read {board}: {done.stderr.strip().splitlines()[-1:] or 'no reason given'}")
        text = report.read_text(encoding="utf-8")
    counts = [int(count) for count in re.findall(r"^\*\* Found (\d+) ", text, re.MULTILINE)]
    found = [
        " ".join(block.split())
        for block in re.findall(r"^\[\w+\]:.*(?:\n .*)*", text, re.MULTILINE)
    ]  # fmt: skip
    if len(counts) != 3 or sum(counts) != len(found):
        raise SheetError(f"KiCad's report on {board} has another form than KiCad 6 gives; open the board in KiCad")
    return found
