"""Times from a touch of a resting sheet to last byte and contact pin, in the gateware."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from contactfpga.errors import ContactFPGAError
from contactfpga.skin import Skin
from contactfpga_sim.apps.latency.spread import MixedTimes, Spread
from contactfpga_sim.apps.latency.usb import ByteStream
from contactfpga_sim.model.board.compiled import CompiledBoard
from contactfpga_sim.model.board.receiver import ReceivedFrame, Receiver

GOLDEN = 0.6180339887498949
"""Golden ratio, whose multiples sample an interval evenly."""

SCANS = 40
"""Scans within which a touch must be reported, beyond twice its debounce time."""

TRIES = 50

CHANGES = 100

MOVING_FRAMES = 300


class RecordedTouch(NamedTuple):
    """A touch and the bytes around it, in clocks from the touch."""

    last: int
    """End of the complete frame's last byte."""
    pin: int
    received: ReceivedFrame
    """The complete frame, in times from power-up."""
    start: int
    stream: ByteStream
    byte: int
    """Index of the complete frame's last byte."""


@dataclasses.dataclass(frozen=True)
class Latency:
    touch_to_last_byte_us: Spread
    touch_to_contact_us: Spread
    change_to_last_byte_us: Spread
    """Time from the loss of a corner to the last byte, for a moving contact on a busy line."""
    frames_per_s: float
    """Rate while the contact moves."""
    bytes: int
    touches: int
    recorded: tuple[RecordedTouch, ...] = dataclasses.field(default=(), repr=False)


class Late(ContactFPGAError):
    """No frame showed a contact in time."""


def places(skin: Skin, height: int, width: int) -> list[np.ndarray]:
    """A contact of height x width cells, (R, C) bool, at every place of the sheet, without masked switches; omitted
    if all are masked."""
    if not (1 <= height <= skin.rows and 1 <= width <= skin.columns):
        raise ValueError(f"the contact has {height}x{width} cells; the sheet has {skin.rows}x{skin.columns}")
    found = []
    for y in range(skin.rows - height + 1):
        for x in range(skin.columns - width + 1):
            cells = np.zeros((skin.rows, skin.columns), bool)
            cells[y : y + height, x : x + width] = True
            for masked in skin.mask:
                cells[masked] = False
            found += [cells] if cells.any() else []
    return found


def measure(
    skin: Skin,
    cells: tuple[int, int] = (3, 3),
    touches: int | None = None,
    step: Callable[[str, int], None] = lambda name, of: None,
    around_us: tuple[int, int] = (0, 0),
) -> Latency:
    """Latency of a contact of ``cells``, rows and columns, at every place, or at ``touches`` of them.

    Each touch follows a report of an empty sheet, at phases spread evenly over a scan; touches that meet a hello or
    keep-alive are repeated. ``step(kind, number of them)`` follows each. ``around_us``: recorded time before a touch,
    and after its frame.

    Raises ValueError for a contact that does not fit, and :class:`Late`.
    """
    contacts = places(skin, *cells)
    chosen = contacts if touches is None else [contacts[i * len(contacts) // touches] for i in range(touches)]
    before, after = (round(us * skin.clock_hz / 1e6) for us in around_us)
    with Bench(skin) as bench:
        found = []
        for number, contact in enumerate(chosen):
            bench.line.clear()
            found.append(bench.touch(contact, number * GOLDEN % 1, before, after))
            step("touches", len(chosen))
        size = max(one.received.size for one in found)
        most = max(int(contact.sum()) for contact in contacts)
        whole = [contact for contact in contacts if contact.sum() == most]  # told from one that lost a corner
        changes = []
        for number in range(min(CHANGES, len(chosen))):
            changes.append(bench.change(whole, number, size))
            step("changes", min(CHANGES, len(chosen)))
        rate = bench.moving(contacts, size)
    return Latency(
        touch_to_last_byte_us=_spread([one.last for one in found], skin),
        touch_to_contact_us=_spread([one.pin for one in found], skin),
        change_to_last_byte_us=_spread(changes, skin),
        frames_per_s=rate,
        bytes=size,
        touches=len(found),
        recorded=tuple(found),
    )


def _spread(clocks: list[int], skin: Skin) -> Spread:
    return MixedTimes.of([count / (skin.clock_hz / 1e6) for count in clocks]).spread()


class Bench:
    """A compiled board that is touched and released repeatedly."""

    def __init__(self, skin: Skin):
        self.line: list[tuple[int, int]] = []
        """Bytes seen: clock at the end of the stop bit, and byte. Readers may clear it."""
        self._cells: int | None = None  # in the last frame that was seen
        self._skin = skin
        self._derived = skin.derived
        self._untouched = np.zeros((skin.rows, skin.columns), bool)
        self._scan = self._derived.frame_clocks
        self._byte = 10 * self._derived.bit_clocks
        debounce = (skin.debounce_press_us + skin.debounce_release_us) * self._derived.clocks_per_us
        self._patience = SCANS * self._scan + round(2 * debounce) * self._derived.debounced
        packet = (self._derived.max_stored_bytes + 4) * self._byte
        self._patience += 4 * packet
        self._board = CompiledBoard(skin, ("bytes", "contact"))
        self._receiver = Receiver(skin)

    def __enter__(self) -> Bench:
        self._board.run(self._patience)
        return self

    def __exit__(self, *_: object) -> None:
        self._board.close()

    def send(self, data: bytes) -> None:
        self._board.send(data)

    def idle(self, clocks: int) -> None:
        self._board.run(clocks)
        self._drop()

    def touch(self, cells: np.ndarray, share: float, before: int = 0, after: int = 0) -> RecordedTouch:
        """Touch at this share of a scan, recording clocks ``before`` the touch and ``after`` its frame."""
        rest = max(3, before // self._scan + 2)
        for _ in range(TRIES):
            self._let_go()
            start = (self._board.cycle // self._scan + rest) * self._scan + round(share * self._scan)
            self._board.run(start - self._board.cycle)
            self._drop()
            self._board.press(cells)
            hellos = self._receiver.hellos
            one, kept_alive = self._wait(int(cells.sum()))
            pin = next(int(event["cycle"]) for event in self._board.take("contact") if event["data"])
            if not kept_alive and self._receiver.hellos == hellos:
                self.idle(after)
                return self._recorded(one, start, pin, before)
        raise Late(
            f"{TRIES} touches in a row met a hello or a keep-alive; keep_alive_ms is {self._skin.keep_alive_ms:g}, "
            "measure with a longer one"
        )

    def _recorded(self, one: ReceivedFrame, start: int, pin: int, before: int) -> RecordedTouch:
        last, until = one.last + self._byte - start, self._board.cycle - start
        seen = [(end - start, value) for end, value in self.line if -before < end - start <= until]
        times, values = np.array(seen, np.int64).reshape(-1, 2).T
        byte = int(np.searchsorted(times, last))
        return RecordedTouch(last, pin - start, one, start, ByteStream(times, values, -before, until), byte)

    def change(self, contacts: list[np.ndarray], number: int, size: int) -> int:
        """Clocks from a change to its frame's last byte: the contact moves, then loses a corner."""
        hold = max(1, size * 10 * self._derived.bit_clocks // 2)
        places = [contacts[(11 * number + place) % len(contacts)] for place in range(8)]
        for cells in places:
            self._board.hold(cells[None], hold)
        self._board.run(round(number * GOLDEN % 1 * max(2 * hold, self._scan)))
        self._drop()
        start, changed = self._board.cycle, places[-1].copy()
        changed[tuple(np.argwhere(changed)[0])] = False
        self._board.press(changed)
        one, _ = self._wait(int(changed.sum()))
        return one.last + self._byte - start

    def moving(self, contacts: list[np.ndarray], size: int) -> float:
        """Frames per second while the contact moves by one place twice per frame time."""
        hold = max(1, size * 10 * self._derived.bit_clocks // 2)
        clocks = max(MOVING_FRAMES * 2 * hold, MOVING_FRAMES // 4 * self._scan)
        self._drop()
        begin, number, received = self._board.cycle, 0, 0
        while self._board.cycle < begin + clocks:
            self._board.hold(contacts[number % len(contacts)][None], hold)
            received += len(self._frames())
            number += 1
        return received * self._skin.clock_hz / (self._board.cycle - begin)

    def _let_go(self) -> None:
        self._board.press(self._untouched)
        if self._cells != 0:
            self._wait(0)

    def _wait(self, cells: int) -> tuple[ReceivedFrame, bool]:
        until = self._board.cycle + self._patience
        kept_alive = False
        while self._board.cycle < until:
            self._board.run(self._scan // 2)
            for one in self._frames():
                if one.frame.cells == cells:
                    return one, kept_alive
                kept_alive |= self._skin.send == "on_change" and one.frame.cells == 0
        raise Late(
            f"no frame with {cells} cells came in {self._patience} clocks; does the Skin's labeller or report leave "
            "cells out?"
        )

    def _frames(self) -> list[ReceivedFrame]:
        events = self._board.take("bytes")
        cycles, values = events["cycle"].tolist(), events["data"].tolist()
        self.line += zip([cycle + self._byte for cycle in cycles], values, strict=True)
        frames = list(self._receiver.take(zip(cycles, values, strict=True)))
        self._cells = frames[-1].frame.cells if frames else self._cells
        return frames

    def _drop(self) -> None:
        self._frames()
        self._board.take("contact")
