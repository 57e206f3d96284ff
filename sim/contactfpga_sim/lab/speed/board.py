"""CPU time of the virtual board on this machine, the best of some runs: `python -m contactfpga_sim.lab.speed.board`.
No test holds it."""

from __future__ import annotations

import os
import sys
import time

from contactfpga.skin import Skin
from contactfpga_sim.model.board import webassembly
from contactfpga_sim.model.board.virtual import VirtualBoard

SKINS = {
    "reference": Skin(),
    "`serial`": Skin(labeller="serial"),
    "32x32": Skin(rows=32, columns=32),
    "64x64": Skin(rows=64, columns=64),
}

RUNS = 10

RUN_S = 0.02


def cycles_per_second(skin: Skin, scene: str = "two_fingers") -> float:
    """Clock cycles per second of the board without a client."""
    cycles = round(RUN_S * skin.clock_hz)
    with VirtualBoard(skin, scene) as board:
        board.advance(cycles)  # the first run finds cold caches
        return cycles / min(_seconds(board, cycles) for _ in range(RUNS))


def _seconds(board: VirtualBoard, cycles: int) -> float:
    started = time.thread_time()
    board.advance(cycles)
    return time.thread_time() - started


def row(name: str, skin: Skin) -> str:
    found = cycles_per_second(skin)
    return f"| {name} | {skin.clock_hz / 1e6:g} MHz | {found / 1e6:.1f} million | {100 * found / skin.clock_hz:.0f} % |"


def main() -> int:
    os.environ[webassembly.NATIVE] = "1"
    print("| Skin | clock | cycles per second | of real time |")
    print("|---|---|---|---|")
    for name, skin in SKINS.items():
        print(row(name, skin), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
