"""Where the values of a knob and the numbers of a chart lie, true to scale."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

LETTER = 7.5
"""Width of a letter or digit, in pixels."""


class Span(NamedTuple):
    """What a value takes of the axis, in pixels: halfway to the values before and after it."""

    start: float
    middle: float
    end: float


def placed(values: Sequence[float], left: float, wide: float) -> tuple[list[Span], str]:
    """The values' places, in the order in which they are turned, and what is to be said of the scale.

    Values that are evenly spaced or reach below 0 lie so; others in powers of ten, where a first value of 0 stands
    apart.
    """
    steps = np.diff(values)
    if np.allclose(steps, steps[0]) or min(values[1:]) <= 0:
        places, scale = np.array(values, float), ""
    elif values[0] == 0:
        after = np.log10(values[1:])
        places, scale = np.concatenate([[2 * after[0] - after[1]], after]), " (logarithmic; 0 stands apart)"
    else:
        places, scale = np.log10(values), " (logarithmic)"
    halfway = (places[1:] + places[:-1]) / 2
    rims = np.concatenate([[2 * places[0] - halfway[0]], halfway, [2 * places[-1] - halfway[-1]]])
    unit = wide / (rims[-1] - rims[0])
    pixels, middles = left + (rims - rims[0]) * unit, left + (places - rims[0]) * unit
    return [Span(*map(float, span)) for span in zip(pixels, middles, pixels[1:])], scale


def shown(words: Sequence[str], spans: Sequence[Span]) -> list[int]:
    """Numbers of the values that are written below the axis: at even steps where they lie so, else all with room."""
    wide = [span.end - span.start for span in spans]
    if np.allclose(wide, wide[0]):
        choices = [list(range(0, len(words), step)) for step in (1, 2, 4, 5, 10, 20, len(words))]
        return next(chosen for chosen in choices if _with_room(words, spans, chosen) == chosen)
    return _with_room(words, spans, range(len(words)))


def _with_room(words: Sequence[str], spans: Sequence[Span], chosen: Sequence[int]) -> list[int]:
    """Those of the chosen that do not come too close to the one before."""
    found, end = [], -math.inf
    for index in chosen:
        half = LETTER * len(words[index]) / 2
        if spans[index].middle - half > end + LETTER:
            found.append(index)
            end = spans[index].middle + half
    return found


def rounded_up(amounts: Sequence[float]) -> list[float]:
    """From 0 in at most four round steps to the least of them that none exceeds; whole ones for whole numbers."""
    most, whole = max(amounts), all(amount == int(amount) for amount in amounts)
    if most <= 0:
        return [0.0, 1.0]
    power = 10.0 ** math.floor(math.log10(most / 4))
    steps = [power * times for times in (1, 2, 2.5, 5, 10)]
    step = next(one for one in steps if one * 4 >= most * (1 - 1e-9) and (one >= 1 or not whole))
    return [step * number for number in range(math.ceil(most / step - 1e-9) + 1)]
