"""A knob as SVG: the share of right draws by value, and the sheet before and at the first break; equal numbers make
equal files."""

from __future__ import annotations

import html
import itertools
import math
import re
import textwrap
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from contactfpga import picture_style as style
from contactfpga_sim.lab import writer
from contactfpga_sim.lab.failures.knob import Knob, Outcome, Sweep
from contactfpga_sim.lab.failures.rated import Rated
from contactfpga_sim.lab.failures.rig import plural

LETTER = 7.5


class Span(NamedTuple):
    """Pixels of a value on the axis: halfway to its neighbors."""

    start: float
    middle: float
    end: float


def placed(values: Sequence[float], left: float, wide: float) -> tuple[list[Span], str]:
    """The values' places in sweep order, and a note on the scale: linear if evenly spaced or negative, else
    logarithmic, with a first 0 set apart."""
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
    """Labeled values: even steps if evenly spaced, else all with room."""
    wide = [span.end - span.start for span in spans]
    if np.allclose(wide, wide[0]):
        choices = [list(range(0, len(words), step)) for step in (1, 2, 4, 5, 10, 20, len(words))]
        return next(chosen for chosen in choices if _with_room(words, spans, chosen) == chosen)
    return _with_room(words, spans, range(len(words)))


def _with_room(words: Sequence[str], spans: Sequence[Span], chosen: Sequence[int]) -> list[int]:
    found, end = [], -math.inf
    for index in chosen:
        half = LETTER * len(words[index]) / 2
        if spans[index].middle - half > end + LETTER:
            found.append(index)
            end = spans[index].middle + half
    return found


COLORS = {"right": style.GREEN, "warned": "#7fcfb9", "told": style.ORANGE, "silent": style.VERMILLION}
TALL = {"right": 4, "warned": 7, "told": 10, "silent": 14}

WORDS = {"right": "right", "warned": "right, warned", "told": "wrong, reported", "silent": "wrong, not noticed"}

NAME, LEFT, TOP, HIGH = 16, 190, 66, 44
"""Left ends of names and charts, a chart's top and height, in pixels."""

BESIDE, ALONE = 274, 510
"""Width of charts with and without sheets."""

STEP = 96

SIDE, SHEETS = 104, (488, 604)


def svg(knob: Knob, methods: Mapping[str, Sweep]) -> str:
    """The picture; methods with equal outcomes share a chart."""
    charts = _alike(methods)
    method, sheets = _sheets(knob, methods)
    spans, scale = placed(knob.values, LEFT, BESIDE if sheets else ALONE)
    bottom = TOP + STEP * len(charts)
    height = max(bottom + 44, TOP + SIDE + 64 if sheets else 0)
    level = _level(knob)
    breaks = f"; a value breaks below the dashed line, {100 * level:g} %" if level and not sheets else ""
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {style.WIDTH_PX} {height}" '
        f'font-family="system-ui,sans-serif" font-size="12" fill="{style.INK}">',
        f'<rect width="{style.WIDTH_PX}" height="{height}" rx="8" fill="{style.CARD}"/>',
        _text(NAME, 24, knob.title, 'font-size="14" font-weight="600"'),
        _text(LEFT, TOP - 14, f"{knob.amount}{breaks}", SOFT),
        *itertools.chain.from_iterable(
            [*_chart(names, outcomes, spans, level, TOP + STEP * row), *_strip(outcomes, spans, TOP + STEP * row)]
            for row, (names, outcomes) in enumerate(charts)
        ),
        *_ticks(knob, spans, bottom + 8),
        _text(LEFT, bottom + 28, f"{knob.axis}{scale}"),
    ]
    unit = knob.axis.rpartition(", ")[2] if ", " in knob.axis else ""
    for number, line in enumerate(textwrap.wrap(_kept_together(method), 32)):
        parts.append(_text(SHEETS[0], TOP - 14 + 15 * number, line, SOFT))
    for left, (caption, outcome) in zip(SHEETS, sheets):
        parts += _sheet(left, TOP + 26, f"at {caption} {unit}".rstrip(), outcome)
    return style.for_dark_pages(writer.spelled("\n".join([*parts, "</svg>"]) + "\n"))


SOFT = f'fill="{style.SOFT}"'


def _level(knob: Knob) -> float | None:
    levels = {run.level for run in knob.runs.values() if isinstance(run, Rated)}
    return levels.pop() if len(levels) == 1 else None


def _alike(methods: Mapping[str, Sweep]) -> list[tuple[list[str], tuple[Outcome, ...]]]:
    found: dict[Any, tuple[list[str], tuple[Outcome, ...]]] = {}
    for name, sweep in methods.items():
        key = tuple((outcome.amount, _kind(outcome)) for outcome in sweep.outcomes)
        found.setdefault(key, ([], sweep.outcomes))[0].append(name)
    return list(found.values())


def _text(x: float, y: float, words: str, style: str = "") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" {style}>{html.escape(words.replace("`", ""))}</text>'


def _chart(
    names: Sequence[str], outcomes: Sequence[Outcome], spans: Sequence[Span], level: float | None, top: float
) -> list[str]:
    left, right = spans[0].start, spans[-1].end
    parts = []
    for number, line in enumerate(textwrap.wrap(_kept_together("; ".join(names)), 20)):
        parts.append(_text(NAME, top + 12 + 15 * number, line, 'font-weight="600"'))
    for share, color in ((1, style.GRID), (0, style.SOFT)):
        y = top + HIGH * (1 - share)
        parts.append(f'<path d="M{left:.1f} {y:.1f}H{right:.1f}" stroke="{color}"/>')
        parts.append(_text(LEFT - 6, y + 4, "all" if share else "none", f'text-anchor="end" {SOFT}'))
    if level:
        y = top + HIGH * (1 - level)
        parts.append(f'<path d="M{left:.1f} {y:.1f}H{right:.1f}" stroke="{style.SOFT}" stroke-dasharray="3 3"/>')
    steps = "".join(
        f"{'M' if number == 0 else 'V'}{f'{left:.1f} ' if number == 0 else ''}{top + HIGH - HIGH * outcome.amount:.0f}"
        f"H{span.end:.1f}"
        for number, (span, outcome) in enumerate(zip(spans, outcomes, strict=True))
    )
    area = f"{steps}V{top + HIGH}H{left:.1f}z"
    parts.append(f'<path class="shares" d="{area}" fill="{style.BLUE}" fill-opacity="0.15"/>')
    parts.append(f'<path d="{steps}" fill="none" stroke="{style.BLUE}" stroke-width="2"/>')
    return parts


def _kept_together(words: str) -> str:
    return re.sub(r"(?<=\d) (?=\S)", "\N{NO-BREAK SPACE}", words)


def _strip(outcomes: Sequence[Outcome], spans: Sequence[Span], top: float) -> list[str]:
    y, parts, said, end = top + HIGH + 6, [], set(), -math.inf
    kinds = list(map(_kind, outcomes))
    for span, kind in zip(spans, kinds, strict=True):
        wide = max(1.0, span.end - span.start - 1)
        parts.append(
            f'<rect class="{kind}" x="{span.start:.1f}" y="{y}" width="{wide:.1f}" '
            f'height="{TALL[kind]}" fill="{COLORS[kind]}"/>'
        )
    for kind, run in itertools.groupby(zip(spans, kinds, strict=True), key=lambda each: each[1]):
        parts_of_run = [span for span, _ in run]
        start, stop = max(parts_of_run[0].start, end + LETTER), parts_of_run[-1].end
        start = min(start, spans[-1].end - LETTER * len(WORDS[kind]) * 0.8)
        if kind not in said and start > end and start < stop:
            parts.append(_text(start, y + 26, WORDS[kind], f'font-size="11" {SOFT}'))
            said.add(kind)
            end = start + LETTER * 0.8 * len(WORDS[kind])
    return parts


def _ticks(knob: Knob, spans: Sequence[Span], y: float) -> list[str]:
    words = [knob.format.format(value) for value in knob.values]
    return [_text(spans[index].middle, y, words[index], 'text-anchor="middle"') for index in shown(words, spans)]


def _kind(outcome: Outcome) -> str:
    return "warned" if outcome.right and outcome.told else outcome.verdict


def _sheets(knob: Knob, methods: Mapping[str, Sweep]) -> tuple[str, list[tuple[str, Outcome]]]:
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
