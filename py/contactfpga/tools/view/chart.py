"""The last seconds as a chart: contacts and their area, each with an axis of its own. SVG in the page's colors."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from contactfpga import picture_style
from contactfpga.tools.view.sources import CHART_S, Strip

WIDTH, HEIGHT = 310, 150
LEFT, RIGHT, TOP, BOTTOM = 26, 34, 24, 118
"""Of the plot within the picture, in its units, about a pixel each."""
SECONDS = (-10, -8, -6, -4, -2, 0)
AREA = "#2b8fd0"
"""Lighter than the pressed cells', to be read on a dark panel too."""


def chart(strip: Strip) -> str:
    """SVG."""
    most, area_cm2 = top(strip.zones, 2), strip.area_mm2 / 100
    most_cm2 = top(area_cm2, 10)
    parts = [
        *_text(LEFT, 12, f"<tspan fill='{picture_style.VERMILLION}'>●</tspan> contacts", "start"),
        *_text(WIDTH - RIGHT, 12, f"<tspan fill='{AREA}'>●</tspan> area, cm²", "end"),
        *_axis(most, LEFT - 4, "end"),
        *_axis(most_cm2, WIDTH - RIGHT + 4, "start"),
        *(part for second in SECONDS for part in _text(_x(second), BOTTOM + 13, _signed(second), "middle")),
        *_text((LEFT + WIDTH - RIGHT) / 2, BOTTOM + 27, "seconds of board time, now at 0", "middle"),
        _line(strip.seconds, area_cm2 / most_cm2, AREA),
        _line(strip.seconds, strip.zones / most, picture_style.VERMILLION),
    ]
    return (
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" width="100%" font-size="10" role="img" '
        f'aria-label="contacts and area over the last {CHART_S:g} seconds">{"".join(parts)}</svg>'
    )


def top(values: np.ndarray, least: int) -> int:
    """1, 2 or 5 times a power of ten, at least the largest value: the axis changes seldom."""
    wanted = max(least, math.ceil(values.max(initial=0.0)))
    power = int(10 ** (len(str(wanted)) - 1))
    return next(times * power for times in (1, 2, 5, 10) if times * power >= wanted)


def _signed(number: float) -> str:
    """Write a number with the minus sign of typography."""
    return f"{number:g}".replace("-", "−")


def _x(seconds: float) -> float:
    return LEFT + (1 + seconds / CHART_S) * (WIDTH - RIGHT - LEFT)


def _y(share: float) -> float:
    return BOTTOM - share * (BOTTOM - TOP)


def _axis(most: int, x: float, anchor: str) -> Iterator[str]:
    """Numbers at 0, half and the top; lines across from the left one."""
    for share in (0.0, 0.5, 1.0):
        y = _y(share)
        yield from _text(x, y + 3.5, f"{share * most:g}", anchor)
        if anchor == "end":
            yield f'<path d="M{LEFT} {y:.1f}H{WIDTH - RIGHT}" stroke="currentColor" stroke-opacity="0.15"/>'


def _text(x: float, y: float, text: str, anchor: str) -> Iterator[str]:
    yield f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="currentColor" fill-opacity="0.8">{text}</text>'


def _line(seconds: np.ndarray, shares: np.ndarray, color: str) -> str:
    """A step for each of the strip's."""
    points = " ".join(f"{_x(second):.1f},{_y(share):.1f}" for second, share in zip(seconds, shares))
    return f'<polyline points="{points}" fill="none" stroke="{color}" stroke-width="1.6" stroke-linejoin="round"/>'
