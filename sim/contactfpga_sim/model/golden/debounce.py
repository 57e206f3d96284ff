"""Debounce of each switch, sample by sample."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from contactfpga.choices import debounces


@dataclasses.dataclass(frozen=True)
class DebounceRule:
    """The golden rule of a debounce for one switch."""

    even: Callable[[list[bool], int, int], list[bool]]
    """Function from samples, one per scan, and press and release in scan periods, to states."""
    timed: Callable[[TimedDebounce, SwitchState, bool, int], None]
    """Function that updates a switch's state by its sample."""


def _rule(method: object) -> DebounceRule:
    found: DebounceRule = debounces.find(method).load_golden()
    return found


def debounced(samples: np.ndarray, method: object, press: int, release: int) -> np.ndarray:
    """States of (F, R, C) bool switches by samples, one per scan; ``press`` and ``release`` in scan periods. A state
    counts from its sample on."""
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


class TimedDebounce:
    """Debounce for a scan that waits, by samples that are not a scan apart; ticks are steps of the us clock.

    A time ends at the first sample at least ``press`` or ``release`` ticks after its beginning.
    """

    def __init__(self, method: object, press: int, release: int):
        self._rule = _rule(method).timed
        self._press, self._release = press, release
        self._switches: dict[tuple[int, int], SwitchState] = {}

    def take(self, cells: np.ndarray, ticks: dict[int, int]) -> tuple[np.ndarray, frozenset[int]]:
        """Take (R, C) bool samples of a frame; ``ticks``: sample times of driven rows.

        Returns the switches' states, and the rows with a pressed switch or a running time.
        """
        counts = np.zeros_like(cells)
        for row, tick in ticks.items():
            for column in range(cells.shape[1]):
                reads, place = bool(cells[row, column]), (row, column)
                if reads or place in self._switches:
                    switch = self._switches.setdefault(place, SwitchState())
                    self._rule(self, switch, reads, tick)
                    counts[place] = switch.pressed
                    if not switch.pressed and switch.since is None:
                        del self._switches[place]
        return counts, frozenset(row for row, _ in self._switches)

    def none(self, switch: SwitchState, reads: bool, tick: int) -> None:
        switch.pressed = reads

    def sym(self, switch: SwitchState, reads: bool, tick: int) -> None:
        if reads == switch.pressed:
            switch.since = None
            return
        if switch.since is None:
            switch.since = tick
        time = self._release if switch.pressed else self._press
        if tick - switch.since >= time:
            switch.pressed, switch.since = reads, None

    def eager(self, switch: SwitchState, reads: bool, tick: int) -> None:
        if not switch.pressed:
            switch.pressed, switch.ignored_since = reads, tick
            return
        if switch.ignored_since is not None:
            if tick - switch.ignored_since < self._press:
                return
            switch.ignored_since = None
        if reads:
            switch.since = None
            return
        if switch.since is None:
            switch.since = tick
            if self._release:
                return
        if tick - switch.since >= self._release:
            switch.pressed, switch.since = False, None


@dataclasses.dataclass
class SwitchState:
    """State of a switch."""

    pressed: bool = False
    since: int | None = None
    """Tick since which readings differ."""
    ignored_since: int | None = None
    """Tick of the press while readings are ignored."""


NONE = DebounceRule(lambda reads, press, release: reads, TimedDebounce.none)
SYM_DEFER = DebounceRule(_sym_defer, TimedDebounce.sym)
ASYM_EAGER_DEFER = DebounceRule(_asym_eager_defer, TimedDebounce.eager)
