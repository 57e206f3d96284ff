"""A scene that stays as it is: how long one frame of it takes, and how many come a second, by the golden model."""

from __future__ import annotations

import bisect

import numpy as np

from contactfpga.skin import Skin
from contactfpga_sim.model.board.receiver import ReceivedFrame, frames_in
from contactfpga_sim.model.golden import Timeline, beginnings, predict, requests

FRAMES = 12
"""Frames between which the rate is taken."""

WARM_US = 1500.0
"""From power-up: by then the first hello is sent, and the link is at work."""


def frame_clocks(skin: Skin, cells: np.ndarray, size: int) -> int:
    """Clocks from the first row time of a frame to the end of its last byte, where nothing else is on the wire.

    ``cells``: (R, C) bool, pressed from the start; ``size``: bytes of their frame. The frame is one that the keep-alive
    sends, with nothing changed.
    """
    if skin.derived.scan.waits:
        return _asked_clocks(skin, cells)
    longest = _longest(skin, size)
    quiet = skin.replace(send="on_change", keep_alive_ms=2e3 * longest / skin.clock_hz)
    last = [got for got in _held(quiet, cells, 8 * longest) if got.frame.cells == cells.sum()][-1]
    end = last.last + 10 * skin.derived.bit_clocks
    begun = beginnings(quiet, Timeline([(0, cells, None)]), end)
    whole = bisect.bisect_right(begun, last.first) - 1  # frames whose scan had ended by then
    return end - begun[whole - 1]


def _asked_clocks(skin: Skin, cells: np.ndarray) -> int:
    """The same of a frame that the host asks for: a scan that waits would keep still for milliseconds."""
    quiet = skin.replace(send="on_change")
    asked = round(WARM_US * skin.clock_hz / 1e6)
    received = requests([asked], skin.derived.bit_clocks)
    late = asked + 10 * skin.derived.bit_clocks * len(received[0][1])
    timeline = Timeline([(0, cells, None)], received)
    end = late + 4 * skin.derived.max_frame_clocks
    frame = next(got for got in frames_in(quiet, predict(quiet, timeline, end).bytes) if got.first > late)
    begun = beginnings(quiet, timeline, frame.first)
    whole = bisect.bisect_right(begun, frame.first) - 1
    return frame.last + 10 * skin.derived.bit_clocks - begun[whole]


def frames_per_second(skin: Skin, cells: np.ndarray, size: int) -> float:
    """Frames of ``size`` bytes that leave in a second while (R, C) bool ``cells`` are pressed."""
    held = _held(skin.replace(send="always"), cells, (FRAMES + 4) * _longest(skin, size))
    ends = [got.last for got in held][-FRAMES - 1 :]
    return (len(ends) - 1) * skin.clock_hz / (ends[-1] - ends[0])


def _longest(skin: Skin, size: int) -> int:
    """Clocks that a frame takes at most, scan and wire."""
    derived = skin.derived
    return derived.frame_clocks + 10 * derived.bit_clocks * size


def _held(skin: Skin, cells: np.ndarray, clocks: int) -> list[ReceivedFrame]:
    """Frames of a board on which ``cells`` are pressed from the start, once hello and debounce are over."""
    debounce_us = skin.debounce_press_us if skin.debounce != "none" else 0.0
    settled = round(max(debounce_us, WARM_US) * skin.clock_hz / 1e6)
    trace = predict(skin, Timeline([(0, cells, None)]), settled + clocks)
    return [got for got in frames_in(skin, trace.bytes) if got.first > settled]
