"""LinkRunCCA: VHDL-2008 that ghdl makes Verilog of."""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from pathlib import Path

from rivals.rival import Rival, RivalError, Sheet

_OWN = Path(__file__).parent / "linkruncca"
_TABLES = ("src/vhdl/vhdl_table_ram_add.vhdl", "src/vhdl/vhdl_table_ram_data.vhdl")
_REST = tuple(
    f"src/vhdl/vhdl_{unit}.vhdl"
    for unit in (
        "equivalence_resolver",
        "feature_accumulator",
        "holes_filler",
        "row_buf",
        "table_reader",
        "window",
        "linkruncca",
    )
)
_COMMENT = re.compile(r" */\*.*?\*/\n?", re.DOTALL)
_LAST_CHOICE = re.compile(r"^( *)\d+'b[01]+: (\w+ <?=) [^;]*;\n(?= *endcase)", re.MULTILINE)


def convert(clone: Path, sheet: Sheet, scrambled: bool = False) -> str:
    """Verilog of LinkRunCCA behind the port; ``scrambled`` as :class:`~rivals.rival.Rival` has it."""
    if shutil.which("ghdl") is None:
        raise RivalError("ghdl, which converts LinkRunCCA's VHDL, was not found; sudo apt install ghdl")
    tables = [_OWN / "scrambled_tables.vhdl"] if scrambled else [clone / name for name in _TABLES]
    with tempfile.TemporaryDirectory() as folder:
        constants = Path(folder) / "sheet.vhdl"
        constants.write_text(_constants(sheet), encoding="utf-8")
        files = [constants, _OWN / "features.vhdl", *tables, *(clone / name for name in _REST), _OWN / "port.vhdl"]
        given = [str(file.resolve()) for file in files]
        command = ["ghdl", "--synth", "--std=08", "--out=verilog", *given, "-e", "top"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if done.returncode:
        raise RivalError(f"ghdl refused LinkRunCCA: {(done.stderr or done.stdout).strip()[-500:]}")
    return mended(done.stdout)


def mended(verilog: str) -> str:
    """What ghdl writes, without comments, which name folders, and without latches.

    ghdl 2 writes a choice of VHDL as a ``case`` over one bit per alternative. One of them is always set, which Yosys
    cannot know. Newer versions write the default themselves.
    """
    return _LAST_CHOICE.sub(r"\g<0>\1default: \2 'bx;\n", _COMMENT.sub("", verilog))


def version() -> str:
    """ghdl's."""
    said = subprocess.run(["ghdl", "--version"], capture_output=True, text=True).stdout
    return " ".join(said.split()[:2])


def _constants(sheet: Sheet) -> str:
    area, sum_x, sum_y = sheet.moment_bits
    numbers = {
        "width": sheet.width,
        "height": sheet.width,  # which it makes no use of
        "x_bits": sheet.place_bits,
        "y_bits": sheet.place_bits,
        # Address bits of its tables, by the rule of its own packages.
        "label_bits": (sheet.width - 1).bit_length() - 1,
        "area_bits": area,
        "sum_x_bits": sum_x,
        "sum_y_bits": sum_y,
    }
    lines = [f"    constant {name}: integer := {number};\n" for name, number in numbers.items()]
    return "package sheet is\n" + "".join(lines) + "end;\n"


LINK_RUN_CCA = Rival(
    name="LinkRunCCA",
    url="https://github.com/Topi-ab/linkruncca",
    commit="a84d236c6e67b3ca511d4dfaa3a11ff605f057de",
    sources=(*_TABLES, *_REST),
    blank_columns=2,
    blank_rows=1,
    convert=convert,
    converter=version,
)
