"""From a touch of a sheet at rest to the last byte and to the contact pin, on the compiled gateware."""

from __future__ import annotations

import dataclasses
import statistics
from collections.abc import Callable

import numpy as np

from contactfpga.errors import ContactFPGAError
from contactfpga.skin import Skin
from contactfpga_sim.model.board.compiled import CompiledBoard
from contactfpga_sim.model.board.receiver import ReceivedFrame, Receiver

GOLDEN = 0.6180339887498949
"""Its multiples lie evenly between two instants, whatever their number."""

SCANS = 40
"""In which a touch must be reported, beside twice the time of its debounce."""

TRIES = 50
"""Of a touch that meets a hello or a keep-alive."""

CHANGES = 100
"""Of a contact that moves."""

MOVING_FRAMES = 300
"""For which the rate is counted, about."""


@dataclasses.dataclass(frozen=True)
class Spread:
    """Times in us."""

    median: float
    worst: float

    @classmethod
    def of(cls, clocks: list[int], skin: Skin) -> Spread:
        us = skin.clock_hz / 1e6
        return cls(statistics.median(clocks) / us, max(clocks) / us)


@dataclasses.dataclass(frozen=True)
class Latency:
    """What :func:`measure` found."""

    touch_to_last_byte_us: Spread
    touch_to_contact_us: Spread
    change_to_last_byte_us: Spread
    """Of a contact that moved before, so that frames are on the wire: it loses a corner."""
    frames_per_s: float
    """Received while the contact moves."""
    bytes: int
    """On the wire, of one frame with the contact; the most."""
    touches: int


class Late(ContactFPGAError):
    """No frame showed a contact in time."""


def places(skin: Skin, height: int, width: int) -> list[np.ndarray]:
    """A contact of height x width cells, (R, C) bool, at every place of the sheet, without the switches that are
    masked; left out where all are."""
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
) -> Latency:
    """A contact of ``cells``, rows and columns, at every place of the sheet, or at ``touches`` of them.

    Each comes when the sheet has been reported untouched, at instants spread evenly over a scan. Touches that meet a
    hello or a keep-alive on the wire are repeated. ``step`` is called after each, with its kind and how many there are.

    Raises ValueError for a contact that does not fit, and :class:`Late`.
    """
    contacts = places(skin, *cells)
    chosen = contacts if touches is None else [contacts[i * len(contacts) // touches] for i in range(touches)]
    with _Bench(skin) as bench:
        found = []
        for number, contact in enumerate(chosen):
            found.append(bench.touch(contact, number * GOLDEN % 1))
            step("touches", len(chosen))
        size = max(one.size for _, _, one in found)
        most = max(int(contact.sum()) for contact in contacts)
        whole = [contact for contact in contacts if contact.sum() == most]  # told from one that lost a corner
        changes = []
        for number in range(min(CHANGES, len(chosen))):
            changes.append(bench.change(whole, number, size))
            step("changes", min(CHANGES, len(chosen)))
        rate = bench.moving(contacts, size)
    return Latency(
        touch_to_last_byte_us=Spread.of([clocks for clocks, _, _ in found], skin),
        touch_to_contact_us=Spread.of([clocks for _, clocks, _ in found], skin),
        change_to_last_byte_us=Spread.of(changes, skin),
        frames_per_s=rate,
        bytes=size,
        touches=len(found),
    )


class _Bench:
    """A compiled board that is touched and let go again and again."""

    def __init__(self, skin: Skin):
        self._skin = skin
        self._derived = skin.derived
        self._untouched = np.zeros((skin.rows, skin.columns), bool)
        self._scan = self._derived.frame_clocks
        debounce = (skin.debounce_press_us + skin.debounce_release_us) * self._derived.clocks_per_us
        self._patience = SCANS * self._scan + round(2 * debounce) * self._derived.debounced
        packet = (self._derived.max_stored_bytes + 4) * 10 * self._derived.bit_clocks
        self._patience += 4 * packet
        self._board = CompiledBoard(skin, ("bytes", "contact"))
        self._receiver = Receiver(skin)

    def __enter__(self) -> _Bench:
        self._board.run(self._patience)
        return self

    def __exit__(self, *_: object) -> None:
        self._board.close()

    def touch(self, cells: np.ndarray, share: float) -> tuple[int, int, ReceivedFrame]:
        """Clocks to the end of the last byte of the frame that holds all of the contact, and to the contact pin."""
        for _ in range(TRIES):
            self._let_go()
            start = (self._board.cycle // self._scan + 3) * self._scan + round(share * self._scan)
            self._board.run(start - self._board.cycle)
            self._drop()
            self._board.press(cells)
            hellos = self._receiver.hellos
            one, kept_alive = self._wait(int(cells.sum()))
            pin = next(int(event["cycle"]) for event in self._board.take("contact") if event["data"])
            if not kept_alive and self._receiver.hellos == hellos:
                return one.last + 10 * self._derived.bit_clocks - start, pin - start, one
        raise Late(
            f"{TRIES} touches in a row met a hello or a keep-alive; keep_alive_ms is {self._skin.keep_alive_ms:g}, "
            "measure with a longer one"
        )

    def change(self, contacts: list[np.ndarray], number: int, size: int) -> int:
        """Clocks from a change to the last byte of the frame that shows it: the contact has moved on by some places,
        and then loses a corner."""
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
        return one.last + 10 * self._derived.bit_clocks - start

    def moving(self, contacts: list[np.ndarray], size: int) -> float:
        """Frames received per second while the contact moves by one place, twice in the time that a frame's bits
        take."""
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
        self._wait(0)

    def _wait(self, cells: int) -> tuple[ReceivedFrame, bool]:
        """The first frame with this many cells, and whether a keep-alive was on the wire before."""
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
        return list(self._receiver.take(zip(events["cycle"].tolist(), events["data"].tolist(), strict=True)))

    def _drop(self) -> None:
        self._frames()
        self._board.take("contact")
