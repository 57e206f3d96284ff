"""A scene that stays as it is: how long one frame of it takes, and how many come a second, by the golden model."""

from __future__ import annotations

import bisect
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga.wire import protocol
from contactfpga_sim.golden import Timeline, Trace, beginnings, predict

FRAMES = 12
"""Frames between which the rate is taken."""

WARM_US = 1500.0
"""From power-up: by then the first hello is sent, and the link is at work."""


class Frame(NamedTuple):
    """A frame on the wire."""

    first: int
    """Cycle in which its first byte is handed to the UART."""
    end: int
    """Cycle in which the stop bit of its last byte ends."""
    bytes: int
    cells: int
    """Pressed cells that it states."""


def frames(skin: Skin, trace: Trace) -> Iterator[Frame]:
    """The frames of a trace that are whole; hellos are passed over."""
    derived = Derived(skin)
    packet = bytearray()
    first = 0
    for cycle, value in trace.bytes:
        first = first if packet else cycle
        if value != protocol.DELIMITER:
            packet.append(value)
            continue
        if not packet:  # in front of a hello
            continue
        plain = protocol.unseal(bytes(packet), protocol.check_prefix(skin))
        if protocol.kind_of(plain) != protocol.KIND_HELLO:
            cells = protocol.decode_frame(plain, derived).cells
            yield Frame(first, cycle + 10 * derived.bit_clocks, len(packet) + 1, cells)
        packet.clear()


def frame_clocks(skin: Skin, cells: np.ndarray, size: int) -> int:
    """Clocks from the first row time of a frame to the end of its last byte, where nothing else is on the wire.

    ``cells``: (R, C) bool, pressed from the start; ``size``: bytes of their frame. The frame is one that the keep-alive
    sends, with nothing changed.
    """
    longest = _longest(skin, size)
    quiet = skin.replace(send="on_change", keep_alive_ms=2e3 * longest / skin.clock_hz)
    last = [frame for frame in _held(quiet, cells, 8 * longest) if frame.cells == cells.sum()][-1]
    begun = beginnings(quiet, Timeline([(0, cells, None)]), last.end)
    whole = bisect.bisect_right(begun, last.first) - 1  # frames whose scan had ended by then
    return last.end - begun[whole - 1]


def frames_per_second(skin: Skin, cells: np.ndarray, size: int) -> float:
    """Frames of ``size`` bytes that leave in a second while (R, C) bool ``cells`` are pressed."""
    held = _held(skin.replace(send="always"), cells, (FRAMES + 4) * _longest(skin, size))
    ends = [frame.end for frame in held][-FRAMES - 1 :]
    return (len(ends) - 1) * skin.clock_hz / (ends[-1] - ends[0])


def _longest(skin: Skin, size: int) -> int:
    """Clocks that a frame takes at most, scan and wire."""
    derived = Derived(skin)
    return derived.frame_clocks + 10 * derived.bit_clocks * size


def _held(skin: Skin, cells: np.ndarray, clocks: int) -> list[Frame]:
    """Frames of a board on which ``cells`` are pressed from the start, once hello and debounce are over."""
    debounce_us = skin.debounce_press_us if skin.debounce != "none" else 0.0
    settled = round(max(debounce_us, WARM_US) * skin.clock_hz / 1e6)
    trace = predict(skin, Timeline([(0, cells, None)]), settled + clocks)
    return [frame for frame in frames(skin, trace) if frame.first > settled]
