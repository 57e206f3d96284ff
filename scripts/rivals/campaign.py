"""Each labeller on each sheet: its frames first, then place and route."""

from __future__ import annotations

import hashlib
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rivals import exactness, placement
from rivals.house import Device, Netlists, Size
from rivals.report import Measured, Row
from rivals.rival import Rival, RivalError, Sheet

OURS = ("run", "serial")
FRAMES = {4: 0, 8: 40_000, 16: 15_000, 32: 3_000, 64: 600}
"""Frames of noise by size of the sheet, beside the shapes; 4x4 has every frame instead."""


def measure(rival: Rival, clone: Path, sizes: Sequence[int], devices: Sequence[Device], seeds: int) -> Measured:
    """The rival and ours; a rival that is wrong gets no place and route. Raises :class:`~rivals.rival.RivalError` if
    ours are wrong."""
    rows: list[Row] = []
    digests: dict[int, str] = {}
    for lines in sizes:
        frames = exactness.frames_for(lines, FRAMES[lines])
        sheet = rival.sheet(lines)
        verilog = rival.convert(clone, sheet, False)
        digests[lines] = hashlib.sha256(verilog.encode()).hexdigest()
        _say(f"{lines}x{lines}: {len(frames):,} frames")
        rows.append(_rival(rival, clone, sheet, verilog, frames, devices, seeds))
        for labeller in OURS:
            checked = _right(labeller, lines, exactness.check_ours(labeller, lines, frames))
            netlists = placement.ours(labeller, lines)
            found = _placed(lines, labeller, netlists, devices, seeds, collides=False)
            rows.append(Row(lines, f"`{labeller}`", checked, None, found))
    return Measured(rival, rival.digest(clone), rival.converter(), seeds, tuple(rows), digests)


def _rival(
    rival: Rival, clone: Path, sheet: Sheet, verilog: str, frames: np.ndarray, devices: Sequence[Device], seeds: int
) -> Row:
    checked = exactness.check_rival(verilog, sheet, frames)
    if checked.wrong:
        return Row(sheet.size, rival.name, checked, None, {})
    scrambled = exactness.check_rival(rival.convert(clone, sheet, True), sheet, frames).wrong
    netlists = placement.rival(verilog, sheet)
    found = _placed(sheet.size, rival.name, netlists, devices, seeds, collides=scrambled > 0)
    return Row(sheet.size, rival.name, checked, scrambled, found)


def _right(name: str, lines: int, checked: exactness.Checked) -> exactness.Checked:
    if checked.wrong:
        raise RivalError(f"{name} is wrong in {checked.wrong:,} of {checked.frames:,} frames of {lines}x{lines}")
    return checked


def _placed(
    lines: int, name: str, netlists: Netlists, devices: Sequence[Device], seeds: int, *, collides: bool
) -> dict[tuple[str, str], Size]:
    found = {}
    for device in devices:
        for setting in placement.SETTINGS:
            _say(f"{lines}x{lines}: {name}, {device.title}, {setting}: place and route {seeds} times")
            commands = placement.before(device, setting, collides)
            found[device.title, setting] = placement.measure(netlists, device, commands, seeds)
    return found


def _say(line: str) -> None:
    print(f"{time.strftime('%H:%M:%S')} {line}", file=sys.stderr, flush=True)
