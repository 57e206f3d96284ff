"""A compiled board with the host's receiver, in simulated time."""

from __future__ import annotations

import math

import numpy as np

from contactfpga.driver.conversation import Conversation, frames_in
from contactfpga.skin import Skin
from contactfpga.wire import protocol
from contactfpga.zones.zone import Zones
from contactfpga_sim.lab.knobs import Place
from contactfpga_sim.model.board.compiled import CompiledBoard
from contactfpga_sim.model.sheet.wiring import LineCuts

REFERENCE = Skin()
GUARDED = REFERENCE.replace(guard=True, alive=True, fail_safe=True)
REVERSAL = REFERENCE.replace(scan="reversal", precharge_us=0.25, settle_us=0.5, release_us=0.05)
REVERSAL_GUARDED = REVERSAL.replace(guard=True)

HELLO_BYTES = len(protocol.encode_hello(REFERENCE.replace(surface="cylinder", radius_mm=100.0, name=32 * "n")))

FRAME_BYTES = 28
"""Bytes of a frame of few zones; a waiting scan may be shorter."""

HELD_SCANS = 5
"""Scans that hold a frame, to outlast a hello."""


class Rig:
    """A board to press and run; :meth:`frames` returns its output."""

    def __init__(self, skin: Skin, capture: tuple[str, ...] = ()):
        self.skin = skin
        self.board = CompiledBoard(skin, capture)
        self.conversation = Conversation("the board")
        self.scan = skin.derived.frame_clocks

    def frames(self) -> list[Zones]:
        return frames_in(self.conversation.receive(self.board.receive(), self.board.cycle / self.skin.clock_hz))

    def __enter__(self) -> Rig:
        return self

    def __exit__(self, *_: object) -> None:
        self.board.close()


def hello_clocks(skin: Skin) -> int:
    """Clocks of scans that the hello at power-up may displace."""
    scan = skin.derived.frame_clocks
    return scan * (math.ceil(HELLO_BYTES * 10 * skin.derived.bit_clocks / scan) + 2)


def held_clocks(skin: Skin) -> int:
    """Clocks of a held frame: whole scans, lest the last be torn, plus some frames on the line."""
    scan = skin.derived.frame_clocks
    return HELD_SCANS * scan * math.ceil(10 * FRAME_BYTES * skin.derived.bit_clocks / scan)


def still(skin: Skin, cells: np.ndarray, cuts: LineCuts | None = None) -> Zones:
    """Frame of a constantly pressed sheet with cut lines."""
    return seen(skin, cells[None], cuts)[0]


def seen(skin: Skin, frames: np.ndarray, cuts: LineCuts | None = None) -> list[Zones]:
    """Last frame at the host for each of (n, rows, columns) bool frames of few zones."""
    with Rig(skin) as rig:
        if cuts is not None:
            rig.board.cut(cuts.rows, cuts.columns)
        start = hello_clocks(skin)
        held = held_clocks(skin)
        rig.board.hold(np.zeros((1, skin.rows, skin.columns), bool), start)
        rig.board.hold(frames, held)
        rig.board.hold(np.zeros((1, skin.rows, skin.columns), bool), held)
        found: dict[int, Zones] = {}
        for zones in rig.frames():
            scan = (zones.time_us * skin.derived.clocks_per_us - start) // held
            found[scan] = zones
        return [found[index] for index in range(len(frames))]


def moments(cells: np.ndarray) -> tuple[int, int, int]:
    """Area, sum x and sum y of (rows, columns) bool cells."""
    y, x = np.nonzero(cells)
    return len(x), int(x.sum()), int(y.sum())


def reported(zones: Zones) -> list[tuple[int, int, int]]:
    return sorted((area, x, y) for area, x, y in zones.frame.moments.tolist())


def places(zones: Zones) -> tuple[Place, ...]:
    """Barycenters of a frame's zones, in cells."""
    return tuple((x / area, y / area) for area, x, y in sorted(zones.frame.moments.tolist(), key=_place))


def _place(sums: list[int]) -> tuple[float, float, int]:
    area, x, y = sums
    return y / area, x / area, area


def faults(zones: Zones) -> tuple[str, ...]:
    return (*sorted(zones.flags - {"fault"}), *sorted(zones.faults))


def plural(count: int, noun: str) -> str:
    return f"{count} {noun}" + ("" if count == 1 else "s")
