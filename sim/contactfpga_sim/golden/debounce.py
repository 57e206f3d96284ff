"""Debounce: what each switch counts as, sample by sample."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from contactfpga.choices import debounces


@dataclasses.dataclass(frozen=True)
class DebounceRule:
    """The golden rule of a debounce, for one switch."""

    even: Callable[[list[bool], int, int], list[bool]]
    """What the switch counts as, from what it reads, a sample per scan; press and release in scan periods."""
    timed: Callable[[Timed, Switch, bool, int], None]
    """The same sample by sample: changes the switch's state by what it reads in a slot."""


def _rule(method: object) -> DebounceRule:
    found: DebounceRule = debounces.find(method).load_golden()
    return found


def debounced(samples: np.ndarray, method: object, press: int, release: int) -> np.ndarray:
    """Debounce (F, R, C) bool samples, one per scan and switch; ``press`` and ``release`` in scan periods.

    Returns (F, R, C) bool: what each switch counts as from its sample of that scan on.
    """
    rule = _rule(method).even
    result = np.zeros_like(samples)
    for place in np.ndindex(*samples.shape[1:]):
        one = samples[(slice(None), *place)]
        if one.any():
            result[(slice(None), *place)] = rule(one.tolist(), press, release)
    return result


def _sym_defer(reads: list[bool], press: int, release: int) -> list[bool]:
    counts = []
    pressed = False
    other = 0
    for read in reads:
        other = other + 1 if read != pressed else 0
        if other == (release if pressed else press) + 1:
            pressed = not pressed
            other = 0
        counts.append(pressed)
    return counts


def _asym_eager_defer(reads: list[bool], press: int, release: int) -> list[bool]:
    counts = []
    pressed = False
    ignored = released = 0
    for read in reads:
        if not pressed:
            if read:
                pressed, ignored, released = True, max(0, press - 1), 0
        elif ignored:
            ignored -= 1
        else:
            released = 0 if read else released + 1
            if released == release + 1:
                pressed = False
        counts.append(pressed)
    return counts


class Timed:
    """The same where samples are not a scan apart; times are counted in slots, one per row time.

    ``press`` and ``release`` in scan periods of ``rows`` slots. A time is over at the first sample that comes later
    than one scan period less after its beginning: with samples a scan period apart, when it is over.
    """

    def __init__(self, method: object, press: int, release: int, rows: int):
        self._rule = _rule(method).timed
        self._press, self._release, self._rows = press, release, rows
        self._switches: dict[tuple[int, int], Switch] = {}

    def take(self, cells: np.ndarray, slots: dict[int, int]) -> tuple[np.ndarray, frozenset[int]]:
        """(R, C) bool samples of a frame; ``slots`` tells when, for the rows that were driven alone.

        Returns what each switch counts as, and the rows with one that counts as pressed or has a time running.
        """
        counts = np.zeros_like(cells)
        for row, slot in slots.items():
            for column in range(cells.shape[1]):
                reads, place = bool(cells[row, column]), (row, column)
                if reads or place in self._switches:
                    switch = self._switches.setdefault(place, Switch())
                    self._rule(self, switch, reads, slot)
                    counts[place] = switch.pressed
                    if not switch.pressed and switch.since is None:
                        del self._switches[place]
        return counts, frozenset(row for row, _ in self._switches)

    def _over(self, since: int, slot: int, scans: int) -> bool:
        return slot - since > (scans - 1) * self._rows

    def none(self, switch: Switch, reads: bool, slot: int) -> None:
        switch.pressed = reads

    def sym(self, switch: Switch, reads: bool, slot: int) -> None:
        if reads == switch.pressed:
            switch.since = None
            return
        if switch.since is None:
            switch.since = slot
        time = self._release if switch.pressed else self._press
        if self._over(switch.since, slot, time):
            switch.pressed, switch.since = reads, None

    def eager(self, switch: Switch, reads: bool, slot: int) -> None:
        if not switch.pressed:
            switch.pressed, switch.ignored_since = reads, slot
            return
        if switch.ignored_since is not None:
            if not self._over(switch.ignored_since, slot, self._press):
                return
            switch.ignored_since = None
        if reads:
            switch.since = None
            return
        if switch.since is None:
            switch.since = slot
            if self._release:
                return
        if self._over(switch.since, slot, self._release):
            switch.pressed, switch.since = False, None


@dataclasses.dataclass
class Switch:
    """State of a switch."""

    pressed: bool = False
    since: int | None = None
    """The slot since when it reads otherwise."""
    ignored_since: int | None = None
    """The slot of its press, while what it reads is ignored."""


NONE = DebounceRule(lambda reads, press, release: reads, Timed.none)
SYM_DEFER = DebounceRule(_sym_defer, Timed.sym)
ASYM_EAGER_DEFER = DebounceRule(_asym_eager_defer, Timed.eager)
