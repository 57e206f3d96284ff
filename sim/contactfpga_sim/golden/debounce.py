"""Debounce: what each switch counts as, sample by sample."""

from __future__ import annotations

import numpy as np


def debounced(samples: np.ndarray, method: str, press: int, release: int) -> np.ndarray:
    """Debounce (F, R, C) bool samples, one a scan and switch; ``press`` and ``release`` in scan periods.

    Returns (F, R, C) bool: what each switch counts as from its sample of that scan on.
    """
    if method == "none":
        return samples
    rule = {"sym_defer_pk": _sym_defer, "asym_eager_defer_pk": _asym_eager_defer}[method]
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
