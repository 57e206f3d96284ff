"""Bounce times of switches from frames with cells."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from contactfpga.errors import ContactFPGAError
from contactfpga.instruments.watch import Cell
from contactfpga.zones.zone import Zones

QUIET_US = 20_000
"""Time without change that ends a bounce; later changes are another touch."""

MARGIN = 2.0
"""Ratio of a proposed time to the longest bounce."""

STEP_US = 100
"""Step of proposed times."""

SLOW = 2.0
"""Ratio to the median bounce from which a switch is slow."""


@dataclasses.dataclass(frozen=True)
class Transition:
    """One press or release."""

    cell: Cell
    pressed: bool
    """Whether this is a press; otherwise it is a release."""
    us: int
    """Time from the first change to the last."""
    changes: int
    """Number of changes; 1: the frames show no bounce."""


@dataclasses.dataclass(frozen=True)
class Proposal:
    """Proposed fields of a Skin."""

    debounce: str
    debounce_press_us: float
    debounce_release_us: float

    @property
    def lines(self) -> str:
        """Lines of a Skin's TOML file."""
        return "\n".join(
            f'{name} = "{value}"' if isinstance(value, str) else f"{name} = {value:g}"
            for name, value in dataclasses.asdict(self).items()
        )


class Bounce:
    """Measures bounce in frames with cells, without debounce. A press or a release is the changes between two rests of
    :data:`QUIET_US`.
    """

    def __init__(self, on_change: bool = False) -> None:
        """``on_change``: whether the board sends no frame while nothing changes."""
        self._on_change = on_change
        self.bounced: list[Transition] = []
        """Presses and releases, in the order of their ends."""
        self.blips: list[Transition] = []
        """Changes that end in the state before: touches shorter than :data:`QUIET_US`, or noise."""
        self._open: np.ndarray
        self._before: np.ndarray
        self._now: np.ndarray
        self._from_us: np.ndarray
        self._to_us: np.ndarray
        self._changes: np.ndarray
        self._last: Zones | None = None
        self._gaps_us: dict[int, int] = {}

    def update(self, zones: Zones) -> None:
        """Add the next frame. Raises :class:`ContactFPGAError` for a frame without cells."""
        if zones.cells is None:
            raise ContactFPGAError('zones do not tell which switch bounces; report = "cells" does')
        last, self._last = self._last, zones
        if last is None or last.cells is None or zones.time_us <= last.time_us:
            self._begin(zones.cells)
            return
        gap_us = zones.time_us - last.time_us
        self._gaps_us[gap_us] = self._gaps_us.get(gap_us, 0) + 1
        changed = zones.cells != last.cells
        if changed.any():
            self._end(changed & self._open & (zones.time_us - self._to_us > QUIET_US))
            first = changed & ~self._open
            self._from_us[first] = zones.time_us
            self._before[first] = last.cells[first]
            self._changes[first] = 0
            self._open |= changed
            self._to_us[changed] = zones.time_us
            self._changes += changed
            self._now = zones.cells.copy()

    def finish(self) -> None:
        """End the transitions that are at rest after the last frame."""
        if self._last is not None:
            self._end(self._open & (self._last.time_us - self._to_us > QUIET_US))

    def _begin(self, cells: np.ndarray) -> None:
        self._open = np.zeros(cells.shape, bool)
        self._before, self._now = cells.copy(), cells.copy()
        self._from_us, self._to_us, self._changes = (np.zeros(cells.shape, np.int64) for _ in range(3))

    def _end(self, ended: np.ndarray) -> None:
        self._open &= ~ended
        for row, column in np.argwhere(ended).tolist():
            at = row, column
            us = int(self._to_us[at] - self._from_us[at])
            one = Transition(at, bool(self._now[at]), us, int(self._changes[at]))
            (self.blips if self._before[at] == self._now[at] else self.bounced).append(one)

    # ---- what they show

    @property
    def resolution_us(self) -> int:
        """Median interval of frames, or the least for a board that sends on change; 0 before the second frame. A
        shorter bounce may be missed, and a measured time may be up to twice this longer."""
        if not self._gaps_us:
            return 0
        if self._on_change:
            return min(self._gaps_us)
        half, seen = sum(self._gaps_us.values()) / 2, 0
        for gap_us in sorted(self._gaps_us):
            seen += self._gaps_us[gap_us]
            if seen >= half:
                break
        return gap_us

    def times_us(self, pressed: bool) -> np.ndarray:
        """(n,) durations of all presses, or all releases, ascending."""
        return np.sort([one.us for one in self.bounced if one.pressed == pressed])

    def longest(self) -> dict[Cell, int]:
        """Longest duration in us by switch, longest first."""
        found: dict[Cell, int] = {}
        for one in self.bounced:
            found[one.cell] = max(one.us, found.get(one.cell, 0))
        return dict(sorted(found.items(), key=lambda item: -item[1]))

    def slow(self) -> dict[Cell, int]:
        """The switches of :meth:`longest` above :data:`SLOW` times the median and two frames."""
        longest = self.longest()
        if not longest:
            return {}
        most = max(SLOW * float(np.median(list(longest.values()))), 2 * self.resolution_us)
        return {cell: us for cell, us in longest.items() if us > most}

    def proposal(self) -> Proposal | None:
        """Times that hide every bounce, seen or missed, times :data:`MARGIN`; None if no switch bounced. A press still
        counts at once."""
        if not any(one.us for one in self.bounced):
            return None
        return Proposal("asym_eager_defer_pk", self._proposed_us(True), self._proposed_us(False))

    def _proposed_us(self, pressed: bool) -> float:
        longest = max(self.times_us(pressed), default=0)
        return float(STEP_US * math.ceil(MARGIN * (longest + 2 * self.resolution_us) / STEP_US))
