"""A study as a picture: what came out at each value, and the sheet before and at the first break.

Written by hand rather than by a plotting library, so that the same numbers always make the same file.
"""

from __future__ import annotations

import html
from collections.abc import Mapping

import numpy as np

from contactfpga_sim.studies.failures.knob import Outcome, Study, Turned
from contactfpga_sim.studies.failures.rig import plural

COLOURS = {"right": "#4f9d69", "warned": "#a9cf6b", "told": "#edae49", "silent": "#d1495b"}
LEGEND = {
    "right": "right",
    "warned": "right, with a warning",
    "told": "wrong, and the system says so",
    "silent": "wrong, not noticed",
}
LINES = ("#2e4057", "#00798c", "#8d6a9f", "#a05a2c")
SHEET, PRESSED, CROSS, GREY = "#eef0f3", "#8fbcd4", "#2e4057", "#555b63"

LEFT, WIDE, HIGH = 50, 400, 110
"""Where the chart begins, and its size, in pixels."""

STRIP = 18
SIDE = 120
"""Size of a sheet."""


def svg(study: Study, methods: Mapping[str, Turned]) -> str:
    """The whole picture."""
    method, sheets = _sheets(study, methods)
    width = LEFT + WIDE + 60 + max(50, len(sheets) * (SIDE + 20))
    height = 40 + HIGH + 2 * STRIP + 2 * STRIP * len(methods) + 34
    top = 36
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="system-ui,sans-serif" '
        'font-size="11">',
        f'<rect width="{width}" height="{height}" fill="#ffffff"/>',
        _text(10, 18, study.title, 'font-size="13" font-weight="600"'),
        *_chart(study, methods, top),
        *_strips(study, methods, top + HIGH + 14),
        _text(LEFT, height - 26, f"turned: {study.knob}", f'fill="{GREY}"'),
        *_legend(height - 8),
    ]
    parts.append(_text(LEFT + WIDE + 30, top - 4, method))
    for number, (caption, outcome) in enumerate(sheets):
        parts += _sheet(LEFT + WIDE + 30 + number * (SIDE + 20), top + 14, caption, outcome)
    return "\n".join([*parts, "</svg>"]) + "\n"


def _text(x: float, y: float, words: str, style: str = "") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" {style}>{html.escape(words.replace("`", ""))}</text>'


def _x(study: Study, index: float) -> float:
    """Values stand side by side, whatever lies between them."""
    return LEFT + WIDE * (index + 0.5) / len(study.values)


def _chart(study: Study, methods: Mapping[str, Turned], top: float) -> list[str]:
    amounts = [outcome.amount for turned in methods.values() for outcome in turned.outcomes]
    high = max(*amounts, 1e-9)
    parts = [
        f'<rect x="{LEFT}" y="{top}" width="{WIDE}" height="{HIGH}" fill="none" stroke="#c9ced6"/>',
        _text(LEFT + 4, top + 12, study.amount, f'fill="{GREY}"'),
        _text(LEFT - 4, top + 8, f"{high:,.4g}", f'fill="{GREY}" text-anchor="end"'),
        _text(LEFT - 4, top + HIGH, "0", f'fill="{GREY}" text-anchor="end"'),
    ]
    for colour, turned in zip(LINES, methods.values(), strict=False):
        points = [
            (_x(study, index), top + HIGH - (HIGH - 18) * outcome.amount / high)
            for index, outcome in enumerate(turned.outcomes)
        ]
        joined = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        parts.append(f'<polyline points="{joined}" fill="none" stroke="{colour}" stroke-width="1.2"/>')
    return parts


def _strips(study: Study, methods: Mapping[str, Turned], top: float) -> list[str]:
    """A bar for each method: green, yellow, red."""
    parts = []
    step = WIDE / len(study.values)
    for number, (colour, (method, turned)) in enumerate(zip(LINES, methods.items(), strict=False)):
        y = top + number * 2 * STRIP
        parts.append(_text(LEFT, y + 8, method, f'fill="{colour}"'))
        for index, kind in enumerate(map(_kind, turned.outcomes)):
            parts.append(
                f'<rect class="{kind}" x="{LEFT + index * step:.1f}" y="{y + 12}" width="{max(1.0, step - 1):.1f}" '
                f'height="{STRIP - 8}" fill="{COLOURS[kind]}"/>'
            )
    y = top + len(methods) * 2 * STRIP
    every = max(1, -(-len(study.values) // 9))
    for index in range(0, len(study.values), every):
        words = study.format.format(study.values[index])
        parts.append(_text(_x(study, index), y + 6, words, f'fill="{GREY}" text-anchor="middle"'))
    return parts


def _legend(y: float) -> list[str]:
    parts = []
    for x, (kind, words) in zip((LEFT, LEFT + 55, LEFT + 190, LEFT + 370), LEGEND.items(), strict=True):
        parts += [f'<rect x="{x}" y="{y - 9}" width="10" height="10" fill="{COLOURS[kind]}"/>', _text(x + 14, y, words)]
    return parts


def _kind(outcome: Outcome) -> str:
    return "warned" if outcome.right and outcome.told else outcome.verdict


def _sheets(study: Study, methods: Mapping[str, Turned]) -> tuple[str, list[tuple[str, Outcome]]]:
    """The first method that gets from right to wrong, and what came out at the two values between which it does."""
    for method, turned in methods.items():
        if turned.broken is None or not turned.broken or turned.outcomes[turned.broken].cells is None:
            continue
        values = (turned.broken - 1, turned.broken)
        return method, [(study.format.format(turned.values[index]), turned.outcomes[index]) for index in values]
    return "", []


def _sheet(left: float, top: float, caption: str, outcome: Outcome) -> list[str]:
    assert outcome.cells is not None
    rows, columns = outcome.cells.shape
    cell = SIDE / max(rows, columns)
    squares = "".join(
        f"M{left + column * cell + 0.5:.1f} {top + row * cell + 0.5:.1f}h{cell - 1:.1f}v{cell - 1:.1f}h-{cell - 1:.1f}z"
        for row, column in zip(*(indices.tolist() for indices in np.nonzero(outcome.cells)))
    )
    crosses = "".join(
        f"M{left + (x + 0.5) * cell - 4:.1f} {top + (y + 0.5) * cell:.1f}h8m-4-4v8" for x, y in outcome.zones
    )
    return [
        _text(left, top - 4, caption),
        f'<rect x="{left}" y="{top}" width="{columns * cell:.1f}" height="{rows * cell:.1f}" fill="{SHEET}"/>',
        f'<path d="{squares}" fill="{PRESSED}"/>',
        f'<path d="{crosses}" stroke="{CROSS}" stroke-width="1.6" fill="none"/>',
        f'<circle cx="{left + 5}" cy="{top + SIDE + 12}" r="4" fill="{COLOURS[_kind(outcome)]}"/>',
        _text(left + 13, top + SIDE + 16, _found(outcome)),
    ]


def _found(outcome: Outcome) -> str:
    assert outcome.cells is not None
    return plural(len(outcome.zones), "zone") if outcome.zones else plural(int(outcome.cells.sum()), "cell")
