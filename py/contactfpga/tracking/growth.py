"""The record of a touch: which cells of a contact's zone closed, and when, by the moments of successive frames.

The moments of a zone (its area, and the sums of its columns and rows) less those of the frame before are the moments of
the cells that changed. One cell is thus known exactly. Of several that closed together the record has their number and
their sums. Of cells that opened while others closed it has nothing, but it knows that this happened.
"""

from __future__ import annotations

from typing import NamedTuple

BOUNCE_US = 5_000
"""Time for which a cell that had closed may be open: longer, and the contact has left it."""

LATE, KNOWN = 2.0, 5
"""A contact of at least :data:`KNOWN` cells closes no further one after a pause of :data:`LATE` times its growth until
then, unless it moves."""


PART = 3
"""Least cells of a part that may be a contact of its own in a zone."""


class Moments(NamedTuple):
    """Number of cells, and sums of their columns and rows."""

    cells: int
    sum_x: int
    sum_y: int

    def plus(self, other: Moments, times: int = 1) -> Moments:
        return Moments(*(one + times * more for one, more in zip(self, other)))

    def shifted(self, columns: int) -> Moments:
        return self._replace(sum_x=self.sum_x + columns * self.cells)


NONE = Moments(0, 0, 0)


class Closing(NamedTuple):
    """Cells that closed between two frames."""

    time_us: int
    """Device time of the frame that showed them."""
    closed: Moments


class Growth:
    """Cells of one contact in the order in which they closed.

    ``around``: columns of a sheet whose ends meet, where columns count on past the seam; 0 for an open sheet.
    """

    def __init__(self, around: int = 0):
        self.closings: list[Closing] = []
        """Every cell once, by time. Cells that bounce keep their first time."""
        self.moved = False
        """Whether the contact did more than grow and shrink in place. It stays so, and nothing more is recorded."""
        self.shrinks = False
        """Whether a cell that had closed is open for longer than it bounces."""
        self.rest_us = 0
        """Time since the zone last changed."""
        self.missed = 0
        """Frames since the first closing that were not given."""
        self._changed_us = 0
        self.apart = 0.0, 0.0
        """Variances along columns and rows, in cells, of the middles of the parts that met in the zone, by their
        cells: any of them may be the contact."""
        self._around = around
        self.now = NONE
        """Moments of the zone in the last frame."""
        self._opened = NONE
        self._opened_us = 0
        """Time since which a cell that had closed is open."""

    @property
    def span_us(self) -> int:
        """Time from the first closing to the last."""
        return self.closings[-1].time_us - self.closings[0].time_us

    @property
    def settled(self) -> bool:
        """Whether the zone has rested for :data:`LATE` times as long as its cells took to close, or may bounce."""
        return self.rest_us > LATE * max(self.span_us, BOUNCE_US)

    def take(self, moments: Moments, time_us: int) -> None:
        """Go on with the contact's zone in the next frame."""
        moments = moments.shifted(self._turn(moments))
        change = moments.plus(self.now, -1)
        self.now = moments
        self._changed_us = self._changed_us if change == NONE else time_us
        self.rest_us = time_us - self._changed_us
        if self.moved:
            return
        if change.cells < 0:
            self._opened_us = self._opened_us if self._opened.cells else time_us
            self._opened = self._opened.plus(change, -1)
        elif change.cells and (change == self._opened or self._has(change)):
            self.moved = not self._opened.cells  # a cell that is closed cannot close
            self._opened = self._opened.plus(change, -1)
        elif change.cells:
            before = self.now.cells + self._opened.cells - change.cells
            self.moved = before >= KNOWN and 0 < LATE * self.span_us < time_us - self.closings[-1].time_us
            self.closings.append(Closing(time_us, change))
        else:
            self.moved = change != NONE
        self.shrinks = self._opened.cells > 0 and time_us - self._opened_us >= BOUNCE_US
        self.moved |= self.shrinks and self._opened_us <= self.closings[-1].time_us

    def join(self, other: Growth) -> None:
        """Add the cells of a contact whose zone is now part of this one's."""
        shift = self._turn(other.now)
        there, joined = other.now.shifted(shift), self.now.plus(other.now.shifted(shift))
        if min(self.now.cells, there.cells) >= PART:
            share = self.now.cells * there.cells / joined.cells**2
            off = [self.now[axis] / self.now.cells - there[axis] / there.cells for axis in (1, 2)]
            self.apart = self.apart[0] + share * off[0] ** 2, self.apart[1] + share * off[1] ** 2
        self.now = joined
        self.closings = sorted(self.closings + [Closing(at, one.shifted(shift)) for at, one in other.closings])
        open_since = [one._opened_us for one in (self, other) if one._opened.cells]
        self._opened_us = min(open_since, default=0)
        self._opened = self._opened.plus(other._opened.shifted(shift))
        self.moved |= other.moved

    def _has(self, change: Moments) -> bool:
        """Whether a change is a single cell that is known to have closed."""
        return change.cells == 1 and any(change == one.closed for one in self.closings)

    def _turn(self, moments: Moments) -> int:
        """Columns by which to shift a zone so that it lies on the same turn as this one."""
        if not (self._around and self.now.cells and moments.cells):
            return 0
        apart = self.now.sum_x / self.now.cells - moments.sum_x / moments.cells
        return self._around * round(apart / self._around)
