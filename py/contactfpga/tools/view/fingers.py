"""Fingers of the mouse on a virtual board."""

from __future__ import annotations

import dataclasses
import threading
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from contactfpga.skin.sheet import Sheet
from contactfpga.zones.around import across

FINGER = 0.9
"""Radius of the mouse's finger over the pitch."""


@dataclasses.dataclass(frozen=True)
class Finger:
    """A round contact."""

    x_mm: float
    """Position along the columns, on the sheet laid flat."""
    y_mm: float
    """Position along the rows."""
    radius_mm: float
    force_n: float

    def covers(self, x_mm: float, y_mm: float, around_mm: float | None = None) -> bool:
        """Whether the finger covers this place; ``around_mm``: see :attr:`contactfpga.skin.sheet.Sheet.around_mm`."""
        off_mm = across(self.x_mm - x_mm, around_mm)
        return off_mm**2 + (self.y_mm - y_mm) ** 2 <= self.radius_mm**2


class Pressable(Protocol):
    """A board that fingers can press."""

    def touch(self, fingers: Sequence[Finger]) -> None:
        """Touch the sheet with these fingers, besides its scene, until the next call; from any thread."""

    @property
    def by_force(self) -> bool:
        """Whether a finger's force matters."""


class Touchable(Pressable, Protocol):
    """A virtual board, such as :class:`contactfpga_sim.model.board.virtual.VirtualBoard`."""

    @property
    def pressed(self) -> np.ndarray:
        """(rows, columns) bool: the closed switches."""

    def clock(self) -> float:
        """Simulated seconds since power-up."""


class Hand:
    """The mouse's fingers. A click adds or lifts a finger. A drag moves the finger at its start, or else a new one that
    its end lifts. Thread-safe.

    :attr:`radius_mm` and :attr:`force_n` are those of the next finger.
    """

    def __init__(self, board: Pressable, radius_mm: float, force_n: float = 5.0, around_mm: float | None = None):
        self.radius_mm, self.force_n = radius_mm, force_n
        self._around_mm = around_mm
        self.board = board
        self._lock = threading.Lock()
        self._down: list[Finger] = []
        self._dragged: dict[object, Finger] = {}
        self._stays: set[object] = set()

    @classmethod
    def on(cls, board: Pressable, sheet: Sheet) -> Hand:
        """A hand with a finger that suits this board's sheet."""
        return cls(board, FINGER * max(sheet.pitch_x_mm, sheet.pitch_y_mm), around_mm=sheet.around_mm)

    @property
    def fingers(self) -> list[Finger]:
        """All fingers on the sheet."""
        with self._lock:
            return self._all()

    def click(self, x_mm: float, y_mm: float) -> None:
        """Put a finger down, or lift those there."""
        with self._lock:
            left = [finger for finger in self._down if not finger.covers(x_mm, y_mm, self._around_mm)]
            if len(left) == len(self._down):
                left.append(self._finger(x_mm, y_mm))
            self._down = left
            self._tell()

    def drag(self, who: object, x_mm: float, y_mm: float) -> None:
        """Begin or continue a drag; ``who``: owner of the mouse."""
        with self._lock:
            before = self._dragged.get(who) or self._taken(who, x_mm, y_mm)
            self._dragged[who] = dataclasses.replace(before, x_mm=x_mm, y_mm=y_mm)
            self._tell()

    def drop(self, who: object) -> None:
        """End a drag."""
        with self._lock:
            finger = self._dragged.pop(who, None)
            if finger is not None and who in self._stays:
                self._down.append(finger)
            self._stays.discard(who)
            self._tell()

    def step(self, x_mm: float, y_mm: float) -> None:
        """Move the finger that was put down last by this much."""
        with self._lock:
            if self._down:
                last = self._down.pop()
                x_mm = last.x_mm + x_mm
                x_mm = x_mm if self._around_mm is None else x_mm % self._around_mm
                self._down.append(dataclasses.replace(last, x_mm=x_mm, y_mm=last.y_mm + y_mm))
                self._tell()

    def resize(self, radius_mm: float | None = None, force_n: float | None = None) -> None:
        """Resize all fingers, and future ones."""
        self.radius_mm = self.radius_mm if radius_mm is None else radius_mm
        self.force_n = self.force_n if force_n is None else force_n
        with self._lock:
            sized = {"radius_mm": self.radius_mm, "force_n": self.force_n}
            self._down = [dataclasses.replace(finger, **sized) for finger in self._down]
            self._tell()

    def lift(self) -> None:
        """Lift all fingers."""
        with self._lock:
            self._down, self._dragged, self._stays = [], {}, set()
            self._tell()

    def _taken(self, who: object, x_mm: float, y_mm: float) -> Finger:
        for finger in self._down:
            if finger.covers(x_mm, y_mm, self._around_mm):
                self._down.remove(finger)
                self._stays.add(who)
                return finger
        return self._finger(x_mm, y_mm)

    def _finger(self, x_mm: float, y_mm: float) -> Finger:
        return Finger(x_mm, y_mm, self.radius_mm, self.force_n)

    def _all(self) -> list[Finger]:
        return [*self._down, *self._dragged.values()]

    def _tell(self) -> None:
        self.board.touch(self._all())
