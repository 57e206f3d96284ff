"""Draws a layout as an SVG picture, as seen from the top side through the board."""

from __future__ import annotations

from collections.abc import Iterator

from contactfpga.design.sheet.drawn import PRINT_MM, VIA_DRILL_MM, VIA_MM, Drawing, Layer, Placed
from contactfpga.design.sheet.gerber import on_layer
from contactfpga.design.sheet.parts import Pad

COLORS: dict[Layer, str] = {"B": "#3465a4", "F": "#c0392b"}
_BOARD, _PRINT, _HOLE, _BODY = "#f4f1e8", "#222", "#fff", "#6b7a8f"


def svg(drawing: Drawing, title: str) -> str:
    """The text of the file; a user unit is a millimeter."""
    return "\n".join([*_lines(drawing, title), ""])


def _lines(drawing: Drawing, title: str) -> Iterator[str]:
    left, top, right, bottom = drawing.outline
    w, h = right - left, bottom - top
    yield (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{left - 1:.2f} {top - 1:.2f} {w + 2:.2f} {h + 2:.2f}" '
        f'width="{w + 2:.2f}mm" height="{h + 2:.2f}mm" role="img">'
    )
    yield f"<title>{title}</title>"
    yield f'<rect x="{left:.3f}" y="{top:.3f}" width="{w:.3f}" height="{h:.3f}" fill="{_BOARD}" stroke="#888" stroke-width="0.2"/>'
    for layer in COLORS:
        yield from _copper(drawing, layer)
    yield f'<g fill="none" stroke="{_BODY}" stroke-width="0.1">'
    for one in drawing.placed:
        yield _body(one)
    yield "</g>"
    yield f'<path fill="none" stroke="{_PRINT}" stroke-width="{PRINT_MM}" stroke-linecap="round" d="{_path(drawing.strokes)}"/>'
    yield f'<g fill="{_HOLE}">'
    for via in drawing.vias:
        yield _circle(via.x, via.y, VIA_DRILL_MM)
    for one in drawing.placed:
        for pad in one.part.pads:
            if pad.drill:
                yield _circle(*one.spot(pad.x, pad.y), pad.drill)
    for hole in drawing.holes:
        yield _circle(hole.x, hole.y, hole.drill)
    yield "</g></svg>"


def _copper(drawing: Drawing, layer: Layer) -> Iterator[str]:
    yield f'<g fill="{COLORS[layer]}" stroke="none">'
    for one in drawing.placed:
        for pad in one.part.pads:
            if on_layer(pad, one, layer):
                yield _pad(one, pad)
    for via in drawing.vias:
        yield _circle(via.x, via.y, VIA_MM)
    yield "</g>"
    for width in sorted({track.width for track in drawing.tracks if track.layer == layer}):
        tracks = [track for track in drawing.tracks if track.layer == layer and track.width == width]
        style = f'fill="none" stroke="{COLORS[layer]}" stroke-width="{width}" stroke-linecap="round"'
        yield f'<path {style} d="{_path(tracks)}"/>'


def _path(lines: list) -> str:
    """Joins lines that follow on each other."""
    words, last = [], None
    for line in lines:
        if (line.x1, line.y1) != last:
            words.append(f"M{line.x1:.2f} {line.y1:.2f}")
        words.append(f"L{line.x2:.2f} {line.y2:.2f}")
        last = line.x2, line.y2
    return "".join(words)


def _circle(x: float, y: float, diameter: float) -> str:
    return f'<circle cx="{x:.2f}" cy="{y:.2f}" r="{diameter / 2:.3g}"/>'


def _pad(one: Placed, pad: Pad) -> str:
    x, y = one.spot(pad.x, pad.y)
    w, h = one.size(pad)
    if pad.round:
        return _circle(x, y, w)
    return f'<rect x="{x - w / 2:.2f}" y="{y - h / 2:.2f}" width="{w:g}" height="{h:g}"/>'


def _body(one: Placed) -> str:
    w, h = (one.part.height, one.part.width) if one.turn % 180 else (one.part.width, one.part.height)
    return f'<rect x="{one.x - w / 2:.2f}" y="{one.y - h / 2:.2f}" width="{w:g}" height="{h:g}"/>'
