"""Draws a layout as SVG: its picture, as seen from the top side through the board, and its assembly drawing."""

from __future__ import annotations

import collections
import math
from collections.abc import Iterable, Iterator, Sequence

from contactfpga import picture_style
from contactfpga.design.sheet.drawing import (
    PRINT_MM,
    VIA_DRILL_MM,
    VIA_MM,
    CopperTrack,
    Drawing,
    Layer,
    PlacedPart,
    Stroke,
)
from contactfpga.design.sheet.gerber import on_layer

COPPER: dict[Layer, tuple[str, str]] = {"B": ("#3465a4", "back copper"), "F": ("#c0392b", "top copper")}
_BOARD, _PRINT, _HOLE, _BODY = "#efe9d8", "#20262e", "#ffffff", "#6b7a8f"
_FIRST, _LEADER = "#c0392b", "#8a4fbf"  # the latter is seen on the board and on both cards


def svg(drawing: Drawing, title: str) -> str:
    """The text of an SVG file; a user unit is a millimeter."""
    return picture_style.for_dark_pages("\n".join([*_lines(drawing, title), ""]))


def _lines(drawing: Drawing, title: str) -> Iterator[str]:
    left, top, right, bottom = drawing.bounds()
    side = min(right - left, bottom - top) / 2
    edge = side / 15
    w, h = right - left + side + 8 * edge, bottom - top + 4 * edge
    yield f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {w:.2f} {h:.2f}">'
    yield f"<title>{title}</title>"
    yield f'<path fill="{picture_style.CARD}" d="{_box(0, 0, w, h)}"/>'
    yield f'<g transform="translate({edge - left:.3f} {edge - top:.3f})">'
    yield '<g id="board">'
    yield f'<path fill="{_BOARD}" stroke="#888" stroke-width="0.2" d="{_edge(drawing)}"/>'
    yield '<g fill="none" stroke-linecap="round">'
    for layer, (color, _) in COPPER.items():
        yield from _copper(drawing, layer, color)
    bodies = "".join(map(_body_of, drawing.placed))
    yield f'<path stroke="{_BODY}" stroke-width="0.1" d="{bodies}"/>'
    yield _printed(drawing, "F")
    yield from _dots(_holes(drawing), _HOLE)
    yield "</g></g>"
    yield from _enlarged(drawing, right + edge, (top + bottom) / 2, side, edge)
    yield from _legend(left, bottom + 1.7 * edge, edge)
    yield "</g></svg>"


def _enlarged(drawing: Drawing, left: float, middle: float, side: float, size: float) -> Iterator[str]:
    """The cell in the middle of the sheet, in a square with that left edge and middle, and the names of what it has."""
    x, y, right, bottom = drawing.bounds()
    switches = [one for one in drawing.placed if one.reference.startswith("SW")]
    switch = min(switches, key=lambda one: math.hypot(2 * one.x - x - right, 2 * one.y - y - bottom))
    reach = 0.75 * max(switch.part.width, switch.part.height)
    x, y, scale, end = switch.x - reach, switch.y - reach, side / (2 * reach), left + side
    top = middle - side / 2
    yield f'<svg x="{left:.2f}" y="{top:.2f}" width="{side:.2f}" height="{side:.2f}" '
    yield f'viewBox="{x:.3f} {y:.3f} {2 * reach:.3f} {2 * reach:.3f}"><use href="#board"/></svg>'
    here = [one for one in drawing.placed if one is switch or set(one.nets.values()) & _between(switch)]
    lines = {net for one in here for net in one.nets.values()} - _between(switch)
    ways = [f"M{left:.2f} {top:.2f}h{side:.2f}v{side:.2f}h{-side:.2f}z", _box(x, y, 2 * reach, 2 * reach)]
    texts = []
    for one in here:
        at = one.y - 0.3 * one.part.height if one is switch else one.y
        height = top + (at - y) * scale
        ways.append(f"M{left + (one.x + 0.4 * one.part.width - x) * scale:.2f} {height:.2f}H{end + 0.4 * size:.2f}")
        texts.append((end + 0.6 * size, height + 0.35 * size, "switch" if one is switch else "diode"))
    for net in sorted(lines):
        near = [t for t in drawing.tracks if t.net == net and _meets(t, x, y, 2 * reach)]
        if net.startswith("ROW"):
            height = top + (min(near, key=lambda one: one.x1).y1 - y) * scale
            texts.append((end + 0.6 * size, height + 0.35 * size, f"row {net[3:]}"))
        else:
            across = left + (min(near, key=lambda one: one.y1).x1 - x) * scale
            texts.append((across, top - 0.5 * size, f"column {net[3:]}"))
    yield f'<path fill="none" stroke="{_LEADER}" stroke-width="{size / 8:.2f}" d="{"".join(ways)}"/>'
    for x, y, words in texts:
        anchor = "start" if x > end else "middle"
        yield f'<text x="{x:.2f}" y="{y:.2f}" text-anchor="{anchor}" {_letters(size)}>{words}</text>'


def _between(switch: PlacedPart) -> set[str]:
    """The net between a switch and its diode; none without diodes."""
    return {net for net in switch.nets.values() if net.startswith("N")}


def _meets(track: CopperTrack, x: float, y: float, side: float) -> bool:
    (x1, x2), (y1, y2) = sorted((track.x1, track.x2)), sorted((track.y1, track.y2))
    return x1 < x + side and x2 > x and y1 < y + side and y2 > y


def _letters(size: float) -> str:
    return f'font-family="sans-serif" font-size="{size:.2f}" fill="{picture_style.INK}"'


def assembly(drawing: Drawing, title: str) -> str:
    """The text of an SVG file that shows the back as its assembler sees it: parts with references, first pins and
    cathodes; a user unit is a millimeter."""
    left, top, right, bottom = drawing.bounds()
    edge = (right - left) / 50
    back = [one for one in drawing.placed if one.back and one.part.soldered]
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {right - left + 2 * edge:.2f} '
        f'{bottom - top + 5 * edge:.2f}">',
        f"<title>{title}, back</title>",
        f'<path fill="#fff" d="{_box(0, 0, right - left + 2 * edge, bottom - top + 5 * edge)}"/>',
        f'<g transform="translate({right + edge:.3f} {edge - top:.3f}) scale(-1 1)" fill="none" '
        'stroke-linecap="round">',
        f'<path fill="{_BOARD}" stroke="#888" stroke-width="0.2" d="{_edge(drawing)}"/>',
        *_pads(back),
        f'<path stroke="{_BODY}" stroke-width="0.15" d="{"".join(_body_of(one) for one in back)}"/>',
        *_dots([(hole.drill, hole.x, hole.y) for hole in drawing.holes], _HOLE),
        _printed(drawing, "B"),
        "</g>",
        *_assembly_legend(edge, bottom - top + 3 * edge, edge, back),
        "</svg>",
        "",
    ]
    return "\n".join(lines)


def _pads(placed: Sequence[PlacedPart]) -> Iterator[str]:
    """Pads, and the first pin or cathode of each part in another color."""
    boxes: dict[bool, list[str]] = {False: [], True: []}
    for one in placed:
        for pad in one.part.pads:
            (x, y), (w, h) = one.spot(pad.x, pad.y), one.size(pad)
            first = pad.number == "1" and bool(one.part.marks)
            boxes[first].append(_box(x - w / 2, y - h / 2, w, h))
    yield f'<path fill="#c9b37c" d="{"".join(boxes[False])}"/>'
    yield f'<path fill="{_FIRST}" d="{"".join(boxes[True])}"/>'


def _assembly_legend(x: float, y: float, size: float, placed: Sequence[PlacedPart]) -> Iterator[str]:
    style = f'font-family="sans-serif" font-size="{0.8 * size:.2f}" fill="{_PRINT}"'
    counts = collections.Counter((one.reference.rstrip("0123456789"), one.value) for one in placed)
    words = ", ".join(f"{count} {letter} {value}" for (letter, value), count in counts.items())
    said = "back, as you look at it; red: cathode of a diode, pin 1 of a chip or header", words
    for number, line in enumerate(said):
        yield f'<text x="{x:.2f}" y="{y + number * size:.2f}" {style}>{line}</text>'


def _copper(drawing: Drawing, layer: Layer, color: str) -> Iterator[str]:
    dots, boxes = [(VIA_MM, via.x, via.y) for via in drawing.vias], []
    for one in drawing.placed:
        for pad in one.part.pads:
            x, y = one.spot(pad.x, pad.y)
            w, h = one.size(pad)
            if on_layer(pad, one, layer) and pad.round:
                dots.append((w, x, y))
            elif on_layer(pad, one, layer):
                boxes.append(_box(x - w / 2, y - h / 2, w, h))
    yield f'<path fill="{color}" d="{"".join(boxes)}"/>'
    yield from _dots(dots, color)
    tracks = [track for track in drawing.tracks if track.layer == layer]
    for width in sorted({track.width for track in tracks}):
        of_width = [track for track in tracks if track.width == width]
        yield f'<path stroke="{color}" stroke-width="{width}" d="{_path(of_width)}"/>'


def _holes(drawing: Drawing) -> Iterator[tuple[float, float, float]]:
    yield from ((VIA_DRILL_MM, via.x, via.y) for via in drawing.vias)
    for one in drawing.placed:
        yield from ((pad.drill, *one.spot(pad.x, pad.y)) for pad in one.part.pads if pad.drill)
    yield from ((hole.drill, hole.x, hole.y) for hole in drawing.holes)


def _dots(dots: Iterable[tuple[float, float, float]], color: str) -> Iterator[str]:
    places = collections.defaultdict(list)
    for diameter, x, y in dots:
        places[diameter].append(f"M{x:.2f} {y:.2f}h0")
    for diameter, words in places.items():
        yield f'<path stroke="{color}" stroke-width="{diameter:g}" d="{"".join(words)}"/>'


def _path(lines: Sequence[CopperTrack | Stroke]) -> str:
    words, last = [], None
    for line in lines:
        if (line.x1, line.y1) != last:
            words.append(f"M{line.x1:.2f} {line.y1:.2f}")
        words.append(f"L{line.x2:.2f} {line.y2:.2f}")
        last = line.x2, line.y2
    return "".join(words)


def _printed(drawing: Drawing, layer: Layer) -> str:
    strokes = [one for one in drawing.strokes if one.layer == layer]
    return f'<path stroke="{_PRINT}" stroke-width="{PRINT_MM}" d="{_path(strokes)}"/>'


def _edge(drawing: Drawing) -> str:
    return "M" + "L".join(f"{x:.2f} {y:.2f}" for x, y in drawing.edge()) + "z"


def _box(x: float, y: float, w: float, h: float) -> str:
    return f"M{x:.2f} {y:.2f}h{w:.2f}v{h:.2f}h{-w:.2f}z"


def _body_of(one: PlacedPart) -> str:
    w, h = (one.part.height, one.part.width) if one.turn % 180 else (one.part.width, one.part.height)
    return _box(one.x - w / 2, one.y - h / 2, w, h)


def _legend(left: float, y: float, size: float) -> Iterator[str]:
    words = [*COPPER.values(), (_BODY, "parts"), (_PRINT, "printed")]
    for number, (color, said) in enumerate(words):
        x = left + number * 9 * size
        yield f'<path fill="{color}" d="{_box(x, y - 0.75 * size, size, 0.75 * size)}"/>'
        yield f'<text x="{x + 1.4 * size:.2f}" y="{y:.2f}" {_letters(size)}>{said}</text>'
