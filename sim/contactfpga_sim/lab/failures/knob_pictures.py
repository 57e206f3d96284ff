"""A knob as a picture: results at each value, and the sheet before and at the first break.

Hand-written, so that the same numbers always make the same file.
"""

from __future__ import annotations

import html
import math
import textwrap
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from contactfpga import picture_style as style
from contactfpga_sim.lab.failures.knob import Knob, Outcome, Sweep
from contactfpga_sim.lab.failures.rig import plural

LETTER = 7.5
"""Width of a letter or digit, in pixels."""


class Span(NamedTuple):
    """The pixels of a value on the axis: halfway to its neighbors."""

    start: float
    middle: float
    end: float


def placed(values: Sequence[float], left: float, wide: float) -> tuple[list[Span], str]:
    """The values' places in sweep order, and a note on the scale.

    Evenly spaced or negative values are linear; others logarithmic, with a first 0 set apart.
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
    """Indexes of the labeled values: at even steps if evenly spaced, else all with room."""
    wide = [span.end - span.start for span in spans]
    if np.allclose(wide, wide[0]):
        choices = [list(range(0, len(words), step)) for step in (1, 2, 4, 5, 10, 20, len(words))]
        return next(chosen for chosen in choices if _with_room(words, spans, chosen) == chosen)
    return _with_room(words, spans, range(len(words)))


def _with_room(words: Sequence[str], spans: Sequence[Span], chosen: Sequence[int]) -> list[int]:
    """The chosen indexes that are not too close to the one before."""
    found, end = [], -math.inf
    for index in chosen:
        half = LETTER * len(words[index]) / 2
        if spans[index].middle - half > end + LETTER:
            found.append(index)
            end = spans[index].middle + half
    return found


def rounded_up(amounts: Sequence[float]) -> list[float]:
    """Round steps from 0, at most four, to the least one above all amounts; integers for integers."""
    most, whole = max(amounts), all(amount == int(amount) for amount in amounts)
    if most <= 0:
        return [0.0, 1.0]
    power = 10.0 ** math.floor(math.log10(most / 4))
    steps = [power * times for times in (1, 2, 2.5, 5, 10)]
    step = next(one for one in steps if one * 4 >= most * (1 - 1e-9) and (one >= 1 or not whole))
    return [step * number for number in range(math.ceil(most / step - 1e-9) + 1)]


COLORS = {"right": style.GREEN, "warned": "#7fcfb9", "told": style.ORANGE, "silent": style.VERMILLION}
TALL = {"right": 4, "warned": 7, "told": 10, "silent": 14}
"""Height of a bar, which repeats its color's meaning."""

LEGEND = {
    "right": (52, "right"),
    "warned": (118, "right, with a warning"),
    "told": (284, "wrong, and the system says so"),
    "silent": (502, "wrong, not noticed"),
}
"""Position of each word."""

LINES = ((style.SKY, 7.0), (style.PURPLE, 5.0), (style.BLUE, 3.0), (style.BLACK, 1.2))
"""Color and width; later methods are wider, so that coinciding lines stay visible."""

LEFT, TOP, HIGH = 52, 62, 110
"""Origin of the chart, and its height, in pixels."""

BESIDE, ALONE = 380, 640
"""Width of the chart beside two sheets, and without."""

STRIP = 36
"""Height of a method's name and bars."""

SIDE, SHEETS = 104, 470
"""Size of a sheet, and position of the first."""


def svg(knob: Knob, methods: Mapping[str, Sweep]) -> str:
    """The whole picture."""
    method, sheets = _sheets(knob, methods)
    spans, scale = placed(knob.values, LEFT, BESIDE if sheets else ALONE)
    bottom = TOP + HIGH + 22 + STRIP * len(methods)
    height = max(bottom + 64, TOP + SIDE + 80)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {style.WIDTH_PX} {height}" '
        f'font-family="system-ui,sans-serif" font-size="12" fill="{style.INK}">',
        f'<rect width="{style.WIDTH_PX}" height="{height}" rx="8" fill="{style.CARD}"/>',
        _text(16, 24, knob.title, 'font-size="14" font-weight="600"'),
        *_chart(knob, methods, spans),
        *_strips(methods, spans, TOP + HIGH + 18),
        *_ticks(knob, spans, bottom + 8),
        _text(LEFT, bottom + 26, f"{knob.axis}{scale}"),
        *_legend(height - 14),
    ]
    for number, line in enumerate(textwrap.wrap(method, 34)):
        parts.append(_text(SHEETS, TOP - 10 + 15 * number, line))
    for number, (caption, outcome) in enumerate(sheets):
        parts += _sheet(SHEETS + number * (SIDE + 20), TOP + 40, f"at {caption}", outcome)
    return "\n".join([*parts, "</svg>"]) + "\n"


def _text(x: float, y: float, words: str, style: str = "") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" {style}>{html.escape(words.replace("`", ""))}</text>'


def _chart(knob: Knob, methods: Mapping[str, Sweep], spans: Sequence[Span]) -> list[str]:
    """Draw the outcomes' amounts; 0 is the frame's bottom."""
    ticks = rounded_up([outcome.amount for sweep in methods.values() for outcome in sweep.outcomes])
    left, right = spans[0].start, spans[-1].end
    parts = [_text(LEFT, TOP - 10, knob.amount)]
    for tick in ticks:
        y = TOP + HIGH - HIGH * tick / ticks[-1]
        color = style.GRID if tick else style.SOFT
        parts.append(f'<path d="M{left:.1f} {y:.1f}H{right:.1f}" stroke="{color}"/>')
        parts.append(_text(LEFT - 6, y + 4, f"{tick:,g}", 'text-anchor="end"'))
    for (color, width), sweep in zip(LINES[-len(methods) :], methods.values(), strict=True):
        joined = " ".join(
            f"{span.middle:.1f},{TOP + HIGH - HIGH * outcome.amount / ticks[-1]:.1f}"
            for span, outcome in zip(spans, sweep.outcomes, strict=True)
        )
        parts.append(
            f'<polyline points="{joined}" fill="none" stroke="{color}" stroke-width="{width}" stroke-linejoin="round"/>'
        )
    return parts


def _strips(methods: Mapping[str, Sweep], spans: Sequence[Span], top: float) -> list[str]:
    """A bar for each method and value."""
    parts = []
    for number, ((color, width), (method, sweep)) in enumerate(
        zip(LINES[-len(methods) :], methods.items(), strict=True)
    ):
        y = top + number * STRIP
        parts.append(f'<path d="M{LEFT} {y + 6:.1f}h20" stroke="{color}" stroke-width="{width}"/>')
        parts.append(_text(LEFT + 26, y + 10, method))
        for span, kind in zip(spans, map(_kind, sweep.outcomes), strict=True):
            tall, wide = TALL[kind], max(1.0, span.end - span.start - 1)
            parts.append(
                f'<rect class="{kind}" x="{span.start:.1f}" y="{y + 30 - tall:.1f}" width="{wide:.1f}" '
                f'height="{tall}" fill="{COLORS[kind]}"/>'
            )
    return parts


def _ticks(knob: Knob, spans: Sequence[Span], y: float) -> list[str]:
    words = [knob.format.format(value) for value in knob.values]
    return [_text(spans[index].middle, y, words[index], 'text-anchor="middle"') for index in shown(words, spans)]


def _legend(y: float) -> list[str]:
    parts = []
    for kind, (x, words) in LEGEND.items():
        parts.append(f'<rect x="{x}" y="{y - TALL[kind]}" width="12" height="{TALL[kind]}" fill="{COLORS[kind]}"/>')
        parts.append(_text(x + 18, y, words))
    return parts


def _kind(outcome: Outcome) -> str:
    return "warned" if outcome.right and outcome.told else outcome.verdict


def _sheets(knob: Knob, methods: Mapping[str, Sweep]) -> tuple[str, list[tuple[str, Outcome]]]:
    """The first method that fails, and its outcomes at the two values around the break."""
    for method, sweep in methods.items():
        if sweep.broken is None or not sweep.broken or sweep.outcomes[sweep.broken].cells is None:
            continue
        values = (sweep.broken - 1, sweep.broken)
        return method, [(knob.format.format(sweep.values[index]), sweep.outcomes[index]) for index in values]
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
        _text(left, top - 6, caption),
        f'<rect x="{left}" y="{top}" width="{columns * cell:.1f}" height="{rows * cell:.1f}" fill="{style.SHEET}"/>',
        f'<path d="{squares}" fill="{style.PRESSED}"/>',
        f'<path d="{crosses}" stroke="{style.INK}" stroke-width="1.6" fill="none"/>',
        f'<circle cx="{left + 5}" cy="{top + SIDE + 14}" r="4.5" fill="{COLORS[_kind(outcome)]}"/>',
        _text(left + 15, top + SIDE + 18, _found(outcome)),
    ]


def _found(outcome: Outcome) -> str:
    assert outcome.cells is not None
    return plural(len(outcome.zones), "zone") if outcome.zones else plural(int(outcome.cells.sum()), "cell")
