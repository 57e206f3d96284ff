"""Figures of scans in the gateware's clock cycles."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contactfpga.shipped import examples
from contactfpga.skin import Skin
from contactfpga_sim.apps.latency import board as latency
from contactfpga_sim.lab import writer
from contactfpga_sim.model.board.compiled import CompiledBoard
from contactfpga_sim.model.board.receiver import frames_in

INSTANTS = 96

SETTINGS = {
    "reference": Skin(),
    "reference, 1 Mbaud": Skin(baud=1_000_000),
    "32x32": Skin(rows=32, columns=32),
    "64x64": Skin(rows=64, columns=64),
    "`icebreaker-64x64.toml`, which can be built": Skin.load(examples() / "icebreaker-64x64.toml"),
}


REPORTS = ("moments", "barycenter")


class EventTimes(NamedTuple):
    """Median and worst us from a closing to an event, over touch phases."""

    median: float
    worst: float

    @classmethod
    def of(cls, cycles: list[int], skin: Skin) -> EventTimes:
        us = np.array(cycles) / (skin.clock_hz / 1e6)
        return cls(float(np.median(us)), float(us.max()))

    def __str__(self) -> str:
        return f"{self.median:.1f} / {self.worst:.1f}"


def one_switch(skin: Skin, row: int) -> np.ndarray:
    """(R, C) bool: the switch in the middle of a row."""
    cells = np.zeros((skin.rows, skin.columns), bool)
    cells[row, skin.columns // 2] = True
    return cells


def dots_in_last_row(skin: Skin) -> np.ndarray:
    """(R, C) bool: every other switch of the last row, the most zones that end in one row."""
    cells = np.zeros((skin.rows, skin.columns), bool)
    cells[-1, ::2] = True
    return cells


def touch_latencies(skin: Skin, touched: np.ndarray | None = None) -> dict[str, EventTimes]:
    """Times from switches of one row closing to the pin, and to the first and last byte of their frame. Default: one
    switch in the first row, the worst."""
    frame = skin.derived.frame_clocks
    touched = one_switch(skin, 0) if touched is None else touched
    untouched = np.zeros_like(touched)
    found: dict[str, list[int]] = {"contact": [], "first byte": [], "last byte": []}
    for instant in range(INSTANTS):
        start = 8 * frame + instant * frame // INSTANTS
        with CompiledBoard(skin, capture=("contact",)) as board:
            board.hold(untouched[None], start)
            board.hold(touched[None], 4 * frame + 100 * skin.derived.bit_clocks * 10)
            found["contact"].append(int(board.take("contact")["cycle"][0]) - start)
            first, last = _first_frame_with_cells(board, skin)
        found["first byte"].append(first - start)
        found["last byte"].append(last - start)
    return {name: EventTimes.of(cycles, skin) for name, cycles in found.items()}


def _first_frame_with_cells(board: CompiledBoard, skin: Skin) -> tuple[int, int]:
    received = board.take("received")
    for got in frames_in(skin, zip(received["cycle"].tolist(), received["data"].tolist())):
        if got.frame.cells:
            return got.first - 10 * skin.derived.bit_clocks, got.last
    raise RuntimeError(f"no frame with the touch came within {len(received)} bytes")


def frame_rate(skin: Skin, scans: int = 400) -> tuple[float, int]:
    """Frames per second with one zone at the host, and bytes of one."""
    cells = np.zeros((skin.rows, skin.columns), bool)
    cells[1:3, 1:3] = True
    with CompiledBoard(skin) as board:
        board.hold(cells[None], scans * skin.derived.frame_clocks)
        frames = list(frames_in(skin, enumerate(board.receive())))
        return len(frames) / (board.cycle / skin.clock_hz), frames[-1].size


def reference_table() -> str:
    head = ("sheet", "scan", "touch to `contact` pin", "touch to last byte", "frames per second", "bytes, one zone")
    return writer.table(head, [reference_row(name, skin) for name, skin in SETTINGS.items()])


def reference_row(name: str, skin: Skin) -> str:
    latency = touch_latencies(skin)
    rate, size = frame_rate(skin)
    scan = skin.derived.frame_clocks / (skin.clock_hz / 1e6)
    times = (f"{scan:g} us", f"{latency['contact']} us", f"**{latency['last byte']} us**")
    return writer.line((name, *times, f"{rate:,.0f}", str(size)))


def report_table() -> str:
    head = ("sheet", "report", "bytes per zone", "first row", "last row", "every other switch of the last row")
    names = ("reference", "32x32", "64x64")
    return writer.table(
        head, [report_row(name, SETTINGS[name].replace(report=report)) for name in names for report in REPORTS]
    )


def report_row(name: str, skin: Skin) -> str:
    scenes = (one_switch(skin, 0), one_switch(skin, skin.rows - 1), dots_in_last_row(skin))
    times = [f"{touch_latencies(skin, touched)['last byte']} us" for touched in scenes]
    return writer.line((name, f"`{skin.report}`", str(skin.derived.record_bytes), *times))


def reference_sample() -> str:
    return reference_row("reference", Skin())


def report_sample() -> str:
    return report_row("reference", Skin(report="moments"))


FAST, FAST_64 = Skin.load(examples() / "fast.toml"), Skin.load(examples() / "fast-64x64.toml")

FAST_SKINS = {
    "16x16": (FAST, (3, 3)),
    "64x64": (FAST_64, (3, 3)),
    "64x64, palm": (FAST_64, (10, 10)),
    "64x64, any pattern": (FAST_64.replace(settle_us=2.9, project_us=8.2), (3, 3)),
}
"""Fast Skins; the last has docs/settle.md's times for any pressed switches."""

TOUCHES = 196
"""Places of a contact."""


def latency_table() -> str:
    head = (
        "sheet", "contact", "touch to `contact` pin, worst", "touch to last byte, median / worst", "bound",
        "change to last byte, worst", "frames per second", "bytes",
    )  # fmt: skip
    rows = [latency_row(name, skin, cells) for name, (skin, cells) in FAST_SKINS.items()]
    return writer.table(head, [*rows, latency_row("16x16, raster, reference", Skin(), (3, 3))])


def latency_row(name: str, skin: Skin, cells: tuple[int, int]) -> str:
    found = latency.measure(skin, cells, TOUCHES)
    last = found.touch_to_last_byte_us
    return writer.line(
        (
            name,
            f"{cells[0]}x{cells[1]}",
            f"{found.touch_to_contact_us.worst:.2f} us",
            f"**{last.median:.1f} / {last.worst:.1f} us**",
            _bound(skin, cells, found),
            f"{found.change_to_last_byte_us.worst:.1f} us",
            f"{found.frames_per_s:,.0f}",
            str(found.bytes),
        )
    )


def _bound(skin: Skin, cells: tuple[int, int], found: latency.Latency) -> str:
    if not skin.reads_rows:
        return ""
    derived = skin.derived
    slots = derived.project_clocks + cells[0] * derived.row_clocks
    bound = (slots + 10 * found.bytes * derived.bit_clocks) / derived.clocks_per_us
    return f"{bound:.1f} us, + {100 * (found.touch_to_last_byte_us.worst / bound - 1):.0f} %"


def latency_sample() -> str:
    return latency_row("16x16", *FAST_SKINS["16x16"])
