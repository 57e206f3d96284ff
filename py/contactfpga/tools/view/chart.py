"""Charts in the panel, as SVG in the page's colors."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from contactfpga import picture_style
from contactfpga.tools.view.sources import CHART_S, Strip

WIDTH, HEIGHT = 310, 150
LEFT, RIGHT, TOP, BOTTOM = 26, 34, 24, 118
SECONDS = (-10, -8, -6, -4, -2, 0)
AREA = "#2b8fd0"
FORCES = ((picture_style.VERMILLION, ""), ("#d99000", "5 2"), (AREA, ""))
"""Colors and dashes of the curves of :func:`force_chart`."""
LEGEND = 14


def chart(strip: Strip) -> str:
    """The strip chart as SVG."""
    most, area_cm2 = top(strip.zones, 2), strip.area_mm2 / 100
    most_cm2 = top(area_cm2, 10)
    parts = [
        *_text(LEFT, 12, f"<tspan fill='{picture_style.VERMILLION}'>●</tspan> contacts", "start"),
        *_text(WIDTH - RIGHT, 12, f"<tspan fill='{AREA}'>●</tspan> area, cm²", "end"),
        *_axis(most, LEFT - 4, "end"),
        *_axis(most_cm2, WIDTH - RIGHT + 4, "start"),
        *_times([(1 + second / CHART_S, _signed(second)) for second in SECONDS], "seconds of board time, now at 0"),
        _line(1 + strip.seconds / CHART_S, area_cm2 / most_cm2, AREA),
        _line(1 + strip.seconds / CHART_S, strip.zones / most, picture_style.VERMILLION),
    ]
    return _svg(parts, HEIGHT, f"contacts and area over the last {CHART_S:g} seconds")


def force_chart(forces_n: np.ndarray, seconds: float, curves: Sequence[tuple[int, str]]) -> str:
    """SVG of (curves, n) forces in N over ``seconds`` from a touch, nan where unknown; ``curves``: number in
    :data:`FORCES` and name of each.
    """
    most = top(np.nan_to_num(forces_n), 5, (1, 2, 3, 4, 6, 8, 10))
    shift = LEGEND * len(curves) - TOP + 18
    parts = []
    for line, (style, name) in enumerate(curves):
        color, dashes = FORCES[style]
        y = 10 + LEGEND * line
        parts += [f'<path d="M{LEFT} {y - 3}h16" {_stroke(color, dashes)}/>', *_text(LEFT + 22, y, name, "start")]
    parts += [f'<g transform="translate(0 {shift})">', *_text(LEFT - 4, TOP - 7, "N", "end")]
    parts += _axis(most, LEFT - 4, "end")
    shares = np.linspace(0, 1, 5)
    parts += _times([(share, f"{1e3 * share * seconds:g}") for share in shares], "ms since the touch")
    times = np.arange(forces_n.shape[1]) / forces_n.shape[1]
    for (style, _), mine in zip(curves, forces_n):
        known = np.isfinite(mine)
        parts.append(_line(times[known], mine[known] / most, *FORCES[style]))
    return _svg([*parts, "</g>"], HEIGHT + shift, "force over the time since the touch")


def _svg(parts: Sequence[str], height: float, label: str) -> str:
    return (
        f'<svg viewBox="0 0 {WIDTH} {height:g}" width="100%" font-size="10" role="img" '
        f'aria-label="{label}">{"".join(parts)}</svg>'
    )


def top(values: np.ndarray, least: int, steps: Sequence[int] = (1, 2, 5, 10)) -> int:
    """Top of an axis: a step times a power of ten, at least the largest value, so that the axis seldom changes."""
    wanted = max(least, math.ceil(values.max(initial=0.0)))
    power = int(10 ** (len(str(wanted)) - 1))
    return next(times * power for times in steps if times * power >= wanted)


def _signed(number: float) -> str:
    return f"{number:g}".replace("-", "−")


def _x(share: float) -> float:
    return LEFT + share * (WIDTH - RIGHT - LEFT)


def _y(share: float) -> float:
    return BOTTOM - share * (BOTTOM - TOP)


def _axis(most: int, x: float, anchor: str) -> Iterator[str]:
    for share in (0.0, 0.5, 1.0):
        y = _y(share)
        yield from _text(x, y + 3.5, f"{share * most:g}", anchor)
        if anchor == "end":
            yield f'<path d="M{LEFT} {y:.1f}H{WIDTH - RIGHT}" stroke="currentColor" stroke-opacity="0.15"/>'


def _times(marks: Iterable[tuple[float, str]], name: str) -> Iterator[str]:
    for share, mark in marks:
        yield from _text(_x(share), BOTTOM + 13, mark, "middle")
    yield from _text((LEFT + WIDTH - RIGHT) / 2, BOTTOM + 27, name, "middle")


def _text(x: float, y: float, text: str, anchor: str) -> Iterator[str]:
    yield f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="currentColor" fill-opacity="0.8">{text}</text>'


def _line(across: np.ndarray, upward: np.ndarray, color: str, dashes: str = "") -> str:
    points = " ".join(f"{_x(x):.1f},{_y(y):.1f}" for x, y in zip(across, upward))
    return f'<polyline points="{points}" fill="none" stroke-linejoin="round" {_stroke(color, dashes)}/>'


def _stroke(color: str, dashes: str) -> str:
    return f'stroke="{color}" stroke-width="1.6"' + (f' stroke-dasharray="{dashes}"' if dashes else "")
