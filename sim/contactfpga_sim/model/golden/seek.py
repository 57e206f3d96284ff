"""Which rows an adaptive scan drives, slot by slot: the rule of docs/timing.md, on sets of row numbers."""

from __future__ import annotations

from collections.abc import Generator

Choice = tuple[frozenset[int], bool]
"""The rows of a slot, and whether it is one row driven alone; else it is a probe."""

Choices = Generator[Choice, bool, None]
"""Yields the choice for each slot; is sent whether any column read pressed in it."""


def frame(rows: int, listed: frozenset[int]) -> Choices:
    """The slots of a frame that begins with these rows on the list."""
    return _Frame(rows, listed).slots()


class _Frame:
    def __init__(self, rows: int, listed: frozenset[int]):
        self._rows = rows
        self._alone = set(listed)
        self._unknown = set(range(rows)) - listed
        self._spare = len(self._unknown) - 1
        self._suspects: set[int] = set()
        self._searches = 0

    def slots(self) -> Choices:
        yield from self._look_at_the_rest()
        while self._alone:
            row = min(self._alone)
            self._alone.remove(row)
            pressed = yield frozenset([row]), True
            if row in self._suspects:
                self._suspects.remove(row)
                if pressed and row + 1 in self._alone | self._unknown:
                    self._drive_alone({row + 1})
                    self._suspects.add(row + 1)
                if not self._suspects:
                    yield from self._look_at_the_rest()

    def _drive_alone(self, found: set[int]) -> None:
        self._alone |= found
        self._unknown -= found

    def _look_at_the_rest(self) -> Choices:
        if not self._unknown:
            return
        if self._spare < 1:
            self._drive_alone(set(self._unknown))
            return
        self._spare -= 1
        hit = yield frozenset(self._unknown), False
        if not hit:
            self._unknown.clear()
        elif self._searches == 2:
            self._drive_alone(set(self._unknown))
        else:
            self._searches += 1
            yield from self._search()

    def _search(self) -> Choices:
        suspects = set(self._unknown)
        half = 1 << (self._rows - 1).bit_length() >> 1
        while half > 1:
            low = {row for row in suspects if not row & half}
            high = suspects - low
            half //= 2
            if not low or not high:
                continue
            if self._spare < 1:
                self._drive_alone(set(self._unknown))
                return
            self._spare -= 1
            if (yield frozenset(low), False):
                suspects = low
            else:
                self._unknown -= low
                suspects = high
        self._suspects = suspects
        self._drive_alone(set(suspects))
