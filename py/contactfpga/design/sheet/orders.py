"""What goes with an order: the note for the board house, and an assembler's list of parts (BOM) and places (CPL)."""

from __future__ import annotations

import collections
import csv
import io
from collections.abc import Iterable, Iterator

from contactfpga import __version__
from contactfpga.design.sheet.drawing import (
    BOARDS,
    CLEARANCE_MM,
    TRACK_MM,
    VIA_DRILL_MM,
    VIA_MM,
    PlacedPart,
)
from contactfpga.design.sheet.layout import Layout

MOST_DESIGNATORS = 200
"""Designators in a row of the parts list; JLCPCB reads no more."""


def table(rows: Iterable[Iterable[object]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def _soldered(layout: Layout) -> list[PlacedPart]:
    return [one for one in layout.drawing.placed if one.part.soldered]


def parts_list(layout: Layout) -> str:
    """The parts that are soldered, as CSV in the columns that assemblers read."""
    kinds: dict[tuple[str, ...], list[str]] = collections.defaultdict(list)
    for one in _soldered(layout):
        maker, number = one.part.article[0], one.part.number(one.value)
        kinds[one.value, one.part.name, maker, number, one.part.order].append(one.reference)
    head = "Comment", "Designator", "Footprint", "Quantity", "Manufacturer", "Manufacturer Part Number", "Description"
    rows = [
        (value, ",".join(some), footprint, len(some), *rest)
        for (value, footprint, *rest), names in kinds.items()
        for some in (names[first : first + MOST_DESIGNATORS] for first in range(0, len(names), MOST_DESIGNATORS))
    ]
    return table([head, *rows])


def placement_list(layout: Layout) -> str:
    """The places of the soldered parts as CSV: in mm from the board's lower left corner, as in the Gerber files, seen
    from the top; the rotation counterclockwise from the orientation of KiCad's library."""
    rows = []
    for one in _soldered(layout):
        x, y = layout.drawing.corner(one.x, one.y)
        turn = (one.turn + (-1 if one.back else 1) * one.part.library_turn) % 360
        rows.append((one.reference, f"{x:.4f}", f"{y:.4f}", "Bottom" if one.back else "Top", turn))
    return table([("Designator", "Mid X", "Mid Y", "Layer", "Rotation"), *rows])


def note(layout: Layout) -> str:
    """The fabrication note for the board house."""
    return "\n".join(f"{title + ':':14}{words}" for title, words in _lines(layout)) + "\n"


def _lines(layout: Layout) -> Iterator[tuple[str, str]]:
    skin, drawing = layout.skin, layout.drawing
    left, top, right, bottom = drawing.bounds()
    flex = skin.surface == "cylinder"
    yield "board", f"contactfpga {__version__}, sheet of {skin.rows}x{skin.columns} {skin.name}".rstrip()
    form = "a rectangle with two tabs" if skin.closed else "a rectangle"
    yield "size", f"{right - left:.2f} x {bottom - top:.2f} mm, +-0.2 mm, {form} (Edge_Cuts)"
    yield "layers", "2: F_Cu on the top, B_Cu on the bottom; all data is seen from the top, with one origin"
    thickness = BOARDS[skin.surface][0]
    if flex:
        yield "material", f"polyimide flex, {thickness:g} mm with coverlay, 35 um of finished copper"
        for letter, where in ("J", "bottom, with the holes of the PTH file"), ("U", "top"):
            places = [
                "{} {:g} x {:g} at {:.2f}, {:.2f}".format(
                    one.reference, one.part.width, one.part.height, *drawing.corner(one.x, one.y)
                )
                for one in drawing.placed
                if one.reference.startswith(letter)
            ]
            if places:
                yield (
                    "stiffeners",
                    f"FR-4 of 0.8 mm on the {where}; mm, middles from the lower left: {', '.join(places)}",
                )
    else:
        yield "material", f"FR-4, {thickness:g} mm, 35 um of finished copper"
    bare = not layout.switch.part.soldered
    touches = "metal domes touch" if layout.switch.part.order else "a film touches"
    yield "finish", "ENIG: gold on nickel" + (f"; not HASL, as {touches} the bare pads" if bare else "")
    yield "solder mask", "both sides, any color" if not flex else "coverlay on both sides, open at the Mask files"
    yield "print", "both sides, white or another color that is easy to read"
    yield "vias", f"{VIA_MM:g} mm with holes of {VIA_DRILL_MM:g} mm, tented on both sides; none lies in a pad"
    yield "least", f"tracks {TRACK_MM:g} mm, clearances {CLEARANCE_MM:g} mm; no controlled impedance"
    yield "holes", "PTH file plated, NPTH file not plated; sizes are finished sizes"
    yield "test", "electrical test of every net by the netlist (IPC-D-356A)"
    if skin.closed:
        yield "delivery", "single boards; an assembler needs a carrier, as copper comes within 0.3 mm of two edges"
    else:
        yield "delivery", "single boards without a panel: 5 mm along each edge are free of parts and serve as rails"
    yield "stencil", f"{'bottom only' if bare else 'both sides'}, if you assemble"
