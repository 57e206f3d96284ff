"""Contacts on a sheet whose ends meet: each one presses wherever it comes to lie around the cylinder.

Laid flat, such a sheet goes on past its ends for any number of turns, and so does everything that touches it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from contactfpga.design.cover import Load, Part
from contactfpga_sim.model.scenes.truth import TOUCH_M, Box, Truth, distance_m, in_order, lies_in, measured, widths


def all_loads(loads: Sequence[Load], left_m: float, around_m: float) -> list[Load]:
    """What presses the sheet that begins at ``left_m``: each load on all turns that come within a turn of it, as a
    cover spreads what lies beside a switch."""
    box = Box(left_m - around_m, left_m + 2 * around_m)
    return [
        Load(tuple(_moved(part, turn * around_m) for part in load.parts), load.force_n)
        for load in loads
        for turn in sorted({turn for part in load.parts for turn in _turns(part, box, around_m)})
    ]


def truth_around(parts: Sequence[Part], box: Box, around_m: float) -> Truth:
    """The contacts that these parts make on a sheet of this circumference, which fills the box.

    The x of a contact counts from 0 to the circumference; one that goes all the way round has none.
    """
    band = Box(top=box.top, bottom=box.bottom)
    return in_order(
        _around(group, box, around_m) if ring else _unrolled(group, band, around_m)
        for group, ring in _groups([part for part in parts if lies_in(part, band)], band, around_m)
    )


def on_all_turns(parts: Sequence[Part], box: Box, around_m: float) -> list[Part]:
    """Where these parts lie in the box, or touch its left or right: each on as many turns as it does."""
    return [_moved(part, turn * around_m) for part in parts for turn in _turns(part, box, around_m)]


def _unrolled(group: Sequence[Part], band: Box, around_m: float) -> tuple[float, float, float]:
    area, x, y = measured(group, band)
    return area, x % around_m % around_m, y  # what is just below 0 is rounded up to a whole turn


def _around(group: Sequence[Part], box: Box, around_m: float) -> tuple[float, float, float]:
    """Parts that lie over each other on several turns count once, so what is measured is one turn of all of them."""
    area, _, y = measured(on_all_turns(group, box, around_m), box)
    return area, math.nan, y


def _groups(parts: Sequence[Part], band: Box, around_m: float) -> Iterator[tuple[list[Part], bool]]:
    """Parts that are joined, each on the turn where it joins the others, and whether a way through them leads round."""
    turns: dict[int, int] = {}
    for seed in range(len(parts)):
        if seed in turns:
            continue
        turns[seed], found, ring = 0, [seed], False
        for one in found:
            for other in range(len(parts)):
                for turn in _meetings(parts[one], parts[other], band, around_m):
                    if other not in turns:
                        turns[other] = turns[one] + turn
                        found.append(other)
                    ring |= turns[other] != turns[one] + turn
        yield [_moved(parts[one], turns[one] * around_m) for one in found], ring


def _meetings(one: Part, other: Part, band: Box, around_m: float) -> list[int]:
    """By how many turns the other part has to be moved to meet this one."""
    near = _turns(other, Box(*widths(one, band)), around_m)
    return [turn for turn in near if distance_m([one, _moved(other, turn * around_m)], band) <= TOUCH_M]


def _turns(part: Part, box: Box, around_m: float) -> range:
    """By how many turns it can be moved to lie between the box's left and right, or to touch them."""
    left, right = widths(part, Box())
    first, last = (box.left - right - TOUCH_M) / around_m, (box.right - left + TOUCH_M) / around_m
    return range(math.ceil(first), math.floor(last) + 1)


def _moved(part: Part, by_m: float) -> Part:
    return part.placed(by_m, 0.0, 0.0)
