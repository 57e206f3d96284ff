"""The program of ``make bitstream-replay``: frames through the netlist of a built board, compared with the golden
model.

The iCE40 boards' netlists are extracted from bitstreams; the ULX3S's is the synthesized one. The transmit and contact
pins are compared in every clock after the power-up reset.
"""

from __future__ import annotations

import argparse
import dataclasses
import itertools
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from contactfpga.boards import BOARDS, find
from contactfpga.boards.spec import BoardSpec
from contactfpga.design import kits
from contactfpga.design.circuit.falling import SIXTEENTHS
from contactfpga.errors import ContactFPGAError, MissingTool
from contactfpga.skin import Skin
from contactfpga.tools.console import interrupt, numbers
from contactfpga_hdl.board import build
from contactfpga_sim.model.board import native
from contactfpga_sim.model.board.compiled import model_of
from contactfpga_sim.model.board.replay import skin_for
from contactfpga_sim.model.golden import Timeline, predict, requests
from contactfpga_sim.model.scenes.recordings import Recording
from contactfpga_sim.model.scenes.shapes import variants
from contactfpga_sim.verify.cosim import bench_native
from contactfpga_sim.verify.cosim.compare import Mismatch, compare
from contactfpga_sim.verify.netlist import extract

FOLDER = Path("build/replay")

BATCH = 500
"""Frames per power-up."""

RESET_US = 20
"""Longest reset of the platform after power-up."""

_STICK = BOARDS["icestick"].skin
_REVERSAL = Skin(scan="reversal", precharge_us=0.25, settle_us=0.5, release_us=0.05)
RUNS: tuple[tuple[str, Skin], ...] = (
    ("icebreaker", skin_for(8, 8, 8, 16)),
    ("icebreaker", BOARDS["icebreaker"].skin),
    ("icestick", _STICK),
    ("icestick", _STICK.replace(report="cells", clock_hz=48_000_000)),
    ("ulx3s-12f", BOARDS["ulx3s-12f"].skin.replace(rows=8, columns=8)),
    ("icebreaker", _REVERSAL.replace(rows=11, columns=12, clock_hz=24_000_000, baud=12_000_000)),
    ("ulx3s-12f", _REVERSAL.replace(rows=8, columns=8, clock_hz=30_000_000, baud=3_000_000)),
    ("icebreaker", _REVERSAL.replace(rows=8, columns=8, guard=True, clock_hz=24_000_000, baud=12_000_000)),
    ("ulx3s-12f", _REVERSAL.replace(rows=8, columns=8, self_test=True, clock_hz=30_000_000, baud=3_000_000)),
    ("icebreaker", kits.kit("soft").skin),
)
"""Default boards and sheets. The first sends every frame, the others overwrite some. The second has rows on shift
registers, the fourth its clock from the PLL, the next four bidirectional pins, the third of these guard lines, the
fourth a self-test. The last has a ruler and levels."""


@dataclasses.dataclass(frozen=True)
class NetlistReplay:
    """A netlist that agrees with the golden model."""

    frames: int
    """Frames, each held for one scan."""
    packets: int
    """Packets on the line, with hellos."""
    clocks: int
    changes: int
    """Changes of the transmit and contact pins."""

    def __add__(self, other: NetlistReplay) -> NetlistReplay:
        pairs = zip(dataclasses.astuple(self), dataclasses.astuple(other), strict=True)
        return NetlistReplay(*(one + two for one, two in pairs))


def replay(skin: Skin, model: native.Model, frames: np.ndarray) -> NetlistReplay:
    """Hold each of (n, rows, columns) bool frames for one scan; raises :class:`Mismatch` at the first difference."""
    reset = reset_clocks(skin, model)
    total = NetlistReplay(0, 0, 0, 0)
    for start in range(0, len(frames), BATCH):
        total += _replay(skin, model, frames[start : start + BATCH], reset)
    return total


def _replay(skin: Skin, model: native.Model, frames: np.ndarray, reset: int) -> NetlistReplay:
    derived = skin.derived
    scan = derived.frame_clocks
    cycles = len(frames) * scan + 2 * derived.max_frame_bytes * 10 * derived.bit_clocks
    received = requests(range(scan // 2, cycles, 37 * scan + 5), derived.bit_clocks)
    timeline = _falling(skin, frames, received) if skin.ruler else Timeline.frames(skin, frames, received=received)
    expected = predict(skin, timeline, cycles)
    got = bench_native.run(skin, _after(timeline, reset), cycles + reset, model)
    changes = compare(expected.at_the_pins(), got.at_the_pins().since(reset))
    return NetlistReplay(len(frames), sum(value == 0 for _, value in expected.bytes), cycles, changes)


def _falling(skin: Skin, frames: np.ndarray, received: Sequence[tuple[int, bytes]]) -> Timeline:
    """Pressed cells fall at any clock of their row, others not; the ruler some clocks later or sooner in each frame."""
    rng, known = np.random.default_rng(len(frames)), skin.derived
    shape = (len(frames), skin.row_lines, skin.columns)
    clocks = rng.integers(1, known.settle_clocks, shape)
    clocks[:, : skin.rows][~frames] = known.row_clocks
    usual = known.settle_clocks * SIXTEENTHS // max(skin.ruler, SIXTEENTHS)
    clocks[:, skin.rows :] = rng.integers(usual // 2, usual + 1, (len(frames), 1, 1))
    return Timeline.falling(skin, clocks, received)


def reset_clocks(skin: Skin, model: native.Model) -> int:
    """Clocks from power-up to cycle 0 of docs/timing.md, by the first hello."""
    limit = RESET_US * skin.derived.clocks_per_us
    untouched = Timeline([])
    hello = predict(skin, untouched, limit).line[0][0]
    line = bench_native.run(skin, untouched, hello + limit, model).line
    if not line:
        raise Mismatch("line", (hello, 0), None)
    return line[0][0] - hello


def _after(timeline: Timeline, cycles: int) -> Timeline:
    pieces = [(start + cycles, cells, stuck) for start, cells, stuck in timeline.pieces]
    received = [(start + cycles, data) for start, data in timeline.received]
    return Timeline(pieces, received, [(start + cycles, cuts) for start, cuts in timeline.cuts])


# ---- frames


def stimulus(skin: Skin, count: int, recordings: Sequence[np.ndarray]) -> np.ndarray:
    """(count, rows, columns) bool frames: shapes that break labellers, windows of recordings, and random ones."""
    rng = np.random.default_rng(count)
    shapes = [cells for _, cells in variants(skin.rows, skin.columns)]
    kinds: list[Iterator[np.ndarray]] = [itertools.cycle(shapes), _random(skin, rng)]
    kinds += [_windows(skin, frames, rng) for frames in recordings if frames.any()]
    return np.array([next(kinds[index % len(kinds)]) for index in range(count)])


def _random(skin: Skin, rng: np.random.Generator) -> Iterator[np.ndarray]:
    while True:
        yield rng.random((skin.rows, skin.columns)) < rng.choice([0.02, 0.1, 0.3, 0.5, 0.7, 0.95])


def _windows(skin: Skin, frames: np.ndarray, rng: np.random.Generator) -> Iterator[np.ndarray]:
    touched = np.flatnonzero(frames.any(axis=(1, 2)))
    while True:
        cells = frames[rng.choice(touched)]
        row, column = rng.choice(np.argwhere(cells))
        top = np.clip(row - skin.rows // 2, 0, max(0, len(cells) - skin.rows))
        left = np.clip(column - skin.columns // 2, 0, max(0, cells.shape[1] - skin.columns))
        part = cells[top : top + skin.rows, left : left + skin.columns]
        yield np.pad(part, ((0, skin.rows - part.shape[0]), (0, skin.columns - part.shape[1])))


# ---- command


def main() -> int:
    """Replay and print the result; returns 1 if a netlist differs or a bitstream does not pack."""
    parser = argparse.ArgumentParser(prog="make bitstream-replay", description=__doc__)
    parser.add_argument("board", nargs="?", choices=list(BOARDS), help="default: 8x8 on one of each FPGA")
    parser.add_argument("--skin", type=Path, help="the board's sheet; default: the one it is built with")
    parser.add_argument(
        "--frames", type=numbers.whole(1, 10**9), default=500, help="for each board (default: %(default)s)"
    )
    words = "one of the default boards; whole numbers that follow each other draw all"
    parser.add_argument("--one", type=int, metavar="NUMBER", help=words)
    words = "a .npz file with frames named `pressed`, or a folder of such files"
    parser.add_argument("--recordings", type=Path, metavar="PATH", help=words)
    args = parser.parse_args()
    if args.skin and not args.board:
        parser.error("--skin needs the board that it is for")
    recordings = [Recording.load(path).pressed for path in recordings_in(args.recordings)]
    print(f"frames       {args.frames} per board: shapes, random ones and {len(recordings)} recordings")
    runs = RUNS if args.one is None else (RUNS[args.one % len(RUNS)],)
    if args.board:
        runs = ((args.board, Skin.load(args.skin) if args.skin else find(args.board).skin),)
    status = 0
    for name, skin in runs:
        board = find(name)
        try:
            megahertz = skin.clock_hz // 1_000_000
            print(f"{board.title}, {skin.rows}x{skin.columns}, report {skin.report!r}, {megahertz} MHz", flush=True)
            _report(board, skin, stimulus(skin, args.frames, recordings))
        except MissingTool as missing:
            print(f"left out     {missing}")
        except (ContactFPGAError, build.BitstreamFailed) as error:
            print(f"FAILED       {error}")
            status = 1
    return status


def recordings_in(path: Path | None) -> list[Path]:
    """The file, or the files in a folder."""
    if path is None:
        return []
    return sorted(path.glob("*.npz")) if path.is_dir() else [path]


def _report(board: BoardSpec, skin: Skin, frames: np.ndarray) -> None:
    folder = FOLDER / board.name
    if board.bitstream == "bin":
        taken = extract.from_bitstream(board, skin, folder)
        print("bitstream    unpacked and packed again: the same bytes; the netlist is taken out of it")
    else:
        taken = extract.synthesized(board, skin, folder)
        print("netlist      synthesized; not placed, not taken out of a bitstream")
    if skin.clock_hz != board.clock_hz:
        print("PLL          a stub drives its output net; it is always locked")
    model = model_of(skin, taken)
    print(f"reset        {reset_clocks(skin, model)} clocks after power-up, then cycle 0 of the golden model")
    started = time.monotonic()
    out = replay(skin, model, frames)
    seconds = time.monotonic() - started
    print(f"the same     {out.frames} frames, {out.packets} packets, {out.changes} changes of the two pins")
    print(f"speed        {out.clocks} clocks in {seconds:.1f} s, golden model included")


if __name__ == "__main__":
    interrupt.leave(interrupt.guarded(main))
