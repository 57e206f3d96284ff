"""Inputs of a board over time, and events at the stage boundaries."""

from __future__ import annotations

import bisect
import dataclasses
import itertools
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from contactfpga_sim.model.golden.facts import facts

if TYPE_CHECKING:
    from contactfpga.skin import Skin

BOUNDARIES = ("rows", "records", "items", "bytes", "line", "contact", "alive")
"""Boundaries at which model and gateware are compared, in order of the data."""


def boundaries(skin: Skin) -> tuple[str, ...]:
    """:data:`BOUNDARIES` of a Skin's board."""
    has = {"items": skin.report == "barycenter", "alive": skin.alive}
    return tuple(name for name in BOUNDARIES if has.get(name, True))


@dataclasses.dataclass(frozen=True)
class Cuts:
    """Cut lines; guard lines count as the last row and column."""

    rows: Mapping[int, int] = dataclasses.field(default_factory=dict)
    """By row the first column whose switches do not reach the row's pin."""
    columns: Mapping[int, int] = dataclasses.field(default_factory=dict)
    """By column the first row whose switches do not reach the column's pin."""

    def reach(self, row: int, column: int) -> bool:
        """Whether a switch is connected to both pins."""
        return column < self.rows.get(row, column + 1) and row < self.columns.get(column, row + 1)


@dataclasses.dataclass(frozen=True)
class Timeline:
    """Inputs at the board's pins from cycle 0 on.

    ``pieces``: (start cycle, cells, stuck); from then on the (R, C) bool ``cells`` are pressed, and the (C,) bool
    ``stuck`` columns read pressed whatever row is driven; None: none; (C + 1,) with a guard column. Starts rise; before
    the first nothing is pressed. ``received``: (cycle, bytes), back to back at the receive pin from that cycle on;
    cycles rise without overlap. ``units``: (start cycle, readings) of the converter's inputs, initially 0. ``cuts``:
    (start cycle, :class:`Cuts`) at rising starts; initially all lines are whole.
    """

    pieces: Sequence[tuple[int, np.ndarray, np.ndarray | None]]
    received: Sequence[tuple[int, bytes]] = ()
    cuts: Sequence[tuple[int, Cuts]] = ()
    units: Sequence[tuple[int, Sequence[int]]] = ()

    def __post_init__(self) -> None:
        starts = [piece[0] for piece in self.pieces]
        if any(late <= early for early, late in itertools.pairwise(starts)):
            raise ValueError("pieces must start at rising cycles")
        if any(late[0] <= early[0] for early, late in itertools.pairwise(self.received)):
            raise ValueError("bytes must be received at rising cycles")
        cut = [start for start, _ in self.cuts]
        if any(late <= early for early, late in itertools.pairwise(cut)):
            raise ValueError("lines must be cut at rising cycles")
        read = [start for start, _ in self.units]
        if any(late <= early for early, late in itertools.pairwise(read)):
            raise ValueError("readings must change at rising cycles")
        object.__setattr__(self, "_starts", starts)
        object.__setattr__(self, "_cut", cut)
        object.__setattr__(self, "_read", read)

    @classmethod
    def frames(
        cls,
        skin: Skin,
        frames: Iterable[np.ndarray],
        stuck: Iterable[np.ndarray | None] | None = None,
        received: Sequence[tuple[int, bytes]] = (),
    ) -> Timeline:
        """Each (R, C) frame, with its stuck columns, held for one scan from power-up."""
        held = [np.asarray(cells, bool) for cells in frames]
        lines = list(stuck) if stuck is not None else [None] * len(held)
        first, scan = facts(skin).first_slot, facts(skin).scan_clocks
        starts = [first * (i > 0) + i * scan for i in range(len(held))]
        pieces = list(zip(starts, held, lines, strict=True))
        return cls(pieces, received)

    @classmethod
    def falling(cls, skin: Skin, frames: Iterable[np.ndarray], received: Sequence[tuple[int, bytes]] = ()) -> Timeline:
        """Frames of (row lines, columns) clocks, a guard row last, from selecting a row until its columns read
        pressed; what takes longer than the row does not. Each is held for one scan from power-up."""
        known = facts(skin)
        order = [*range(known.rows, known.row_lines), *range(known.rows)]
        pieces, cuts = {}, {0: Cuts()}
        for frame, clocks in enumerate(frames):
            for slot, row in enumerate(order, frame * known.row_lines):
                start = known.first_slot + slot * known.row_clocks
                fall = np.minimum(clocks[row], known.row_clocks)
                for clock in {-1, *fall[fall < known.row_clocks].tolist()}:
                    at = max(0, start + clock)
                    pieces[at] = np.tile(fall <= clock, (known.rows, 1))
                    if row == known.rows:
                        cuts[at] = Cuts({}, dict.fromkeys(np.flatnonzero(fall > clock).tolist(), row))
        held = [(at, pieces[at], None) for at in sorted(pieces)]
        return cls(held, received, [(at, cuts[at]) for at in sorted(cuts)])

    def at(self, cycle: int) -> tuple[np.ndarray | None, np.ndarray | None]:
        """Cells and stuck columns in ``cycle``; None: none pressed."""
        index = bisect.bisect_right(self._starts, cycle) - 1  # type: ignore[attr-defined]
        return (None, None) if index < 0 else (self.pieces[index][1], self.pieces[index][2])

    def cuts_at(self, cycle: int) -> Cuts:
        """Cut lines in ``cycle``."""
        index = bisect.bisect_right(self._cut, cycle) - 1  # type: ignore[attr-defined]
        return Cuts() if index < 0 else self.cuts[index][1]

    def units_at(self, cycle: int, unit: int) -> int:
        """Reading of a unit in ``cycle``."""
        index = bisect.bisect_right(self._read, cycle) - 1  # type: ignore[attr-defined]
        return 0 if index < 0 else self.units[index][1][unit]


@dataclasses.dataclass
class Trace:
    """Events at every boundary in cycles 0 to ``cycles`` - 1, in cycle order."""

    cycles: int
    rows: list[tuple[int, int, bool]] = dataclasses.field(default_factory=list)
    """(cycle, cells, last) of rows handed to the labeller; bit c is column c, or bits 2 c and 2 c + 1 are its level."""
    records: list[tuple[int, int, bool]] = dataclasses.field(default_factory=list)
    """(cycle, data, end): a zone's exact moments or a bitmap row, in bit fields as on the wire, or an end mark."""
    items: list[tuple[int, int, bool]] = dataclasses.field(default_factory=list)
    """(cycle, data, end): divided records of ``report = "barycenter"``, when the packer reads them."""
    bytes: list[tuple[int, int]] = dataclasses.field(default_factory=list)
    """(cycle, value) of each byte handed to the UART."""
    line: list[tuple[int, int]] = dataclasses.field(default_factory=list)
    """(cycle, level) of changes, high before cycle 0."""
    contact: list[tuple[int, int]] = dataclasses.field(default_factory=list)
    """(cycle, level) of changes, low before cycle 0."""
    alive: list[tuple[int, int]] = dataclasses.field(default_factory=list)
    """(cycle, level) of changes, low before cycle 0."""

    def events(self, boundary: str) -> list[tuple[Any, ...]]:
        """Events of one of :data:`BOUNDARIES`."""
        return getattr(self, boundary)

    def until(self, cycles: int) -> Trace:
        """Trace that ends before ``cycles``."""
        kept = {name: [event for event in self.events(name) if event[0] < cycles] for name in BOUNDARIES}
        return Trace(min(cycles, self.cycles), **kept)

    def at_the_pins(self) -> Trace:
        """Trace of the pins alone."""
        return Trace(self.cycles, line=self.line, contact=self.contact, alive=self.alive)

    def since(self, cycle: int) -> Trace:
        """Trace with ``cycle`` counted as 0."""
        shifted = {name: [(at - cycle, *rest) for at, *rest in self.events(name)] for name in BOUNDARIES}
        return Trace(self.cycles - cycle, **shifted)
