"""A layout for a board house: Gerber layers, drill files, and the netlist for its electrical test.

The formats are Gerber X2 (Ucamco, 2021), Excellon in millimeters, and IPC-D-356A; y points up, and (0, 0) is the
board's lower left corner. The names are those that KiCad gives with Protel's extensions, which board houses recognize.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

from contactfpga.design.sheet.drawing import (
    PRINT_MM,
    VIA_DRILL_MM,
    VIA_MM,
    Drawing,
    Layer,
    PlacedPart,
)
from contactfpga.design.sheet.parts import Pad

EDGE_LINE_MM = 0.1


def files(drawing: Drawing, name: str) -> dict[str, str]:
    """The text of each file by name; a side without paste has no paste file, as its file would be an empty stencil."""
    found: dict[str, str] = {}
    sides: tuple[tuple[Layer, str, str, str], ...] = ("F", "t", "L1", "Top"), ("B", "b", "L2", "Bot")
    for layer, end, number, side in sides:
        plots = {
            f"Cu.g{end}l": _Plot(drawing, f"Copper,{number},{side}").copper(layer),
            f"Mask.g{end}s": _Plot(drawing, f"Soldermask,{side}", negative=True).pads(layer),
            f"Paste.g{end}p": _Plot(drawing, f"Paste,{side}").pads(layer, pasted=True),
            f"Silkscreen.g{end}o": _Plot(drawing, f"Legend,{side}").print(layer),
        }
        found |= {f"{name}-{layer}_{end}": plot.text() for end, plot in plots.items() if plot.drawn}
    found[f"{name}-Edge_Cuts.gm1"] = _Plot(drawing, "Profile,NP").edge().text()
    found[f"{name}-PTH.drl"] = _drill(drawing, _plated(drawing), "Plated,1,2,PTH")
    unplated = [(hole.drill, hole.x, hole.y) for hole in drawing.holes]
    found[f"{name}-NPTH.drl"] = _drill(drawing, unplated, "NonPlated,1,2,NPTH")
    found[f"{name}.ipc"] = "\r\n".join(_ipc(drawing)) + "\r\n"
    return found


def on_layer(pad: Pad, one: PlacedPart, layer: Layer) -> bool:
    return bool(pad.drill) or one.back == (layer == "B")


class _Plot:
    def __init__(self, drawing: Drawing, function: str, negative: bool = False):
        self.drawing = drawing
        self.head = [
            "%TF.GenerationSoftware,contactfpga,sheet*%",
            f"%TF.FileFunction,{function}*%",
            f"%TF.FilePolarity,{'Negative' if negative else 'Positive'}*%",
            "%FSLAX46Y46*%",
            "%MOMM*%",
            "%LPD*%",
        ]
        self.drawn: dict[str, list[str]] = {}

    def line(self, width: float, x1: float, y1: float, x2: float, y2: float) -> None:
        self.drawn.setdefault(f"C,{width:.6f}", []).extend([self._at(x1, y1, 2), self._at(x2, y2, 1)])

    def flash(self, shape: str, x: float, y: float) -> None:
        """A pad: ``C,diameter`` or ``R,widthXheight``."""
        self.drawn.setdefault(shape, []).append(self._at(x, y, 3))

    def _at(self, x: float, y: float, code: int) -> str:
        x, y = self.drawing.corner(x, y)
        return f"X{round(x * 1e6)}Y{round(y * 1e6)}D{code:02d}*"

    def text(self) -> str:
        shapes = list(enumerate(self.drawn, 10))
        lines = [*self.head, *(f"%ADD{code}{shape}*%" for code, shape in shapes), "G01*"]
        for code, shape in shapes:
            lines += [f"D{code}*", *self.drawn[shape]]
        return "\n".join([*lines, "M02*"]) + "\n"

    def _pad(self, one: PlacedPart, pad: Pad, grown: float) -> None:
        w, h = (size + 2 * grown for size in one.size(pad))
        self.flash(f"C,{w:.6f}" if pad.round else f"R,{w:.6f}X{h:.6f}", *one.spot(pad.x, pad.y))

    def copper(self, layer: Layer) -> _Plot:
        for one in self.drawing.placed:
            for pad in one.part.pads:
                if on_layer(pad, one, layer):
                    self._pad(one, pad, 0.0)
        for via in self.drawing.vias:
            self.flash(f"C,{VIA_MM:.6f}", via.x, via.y)
        for track in self.drawing.tracks:
            if track.layer == layer:
                self.line(track.width, track.x1, track.y1, track.x2, track.y2)
        return self

    def pads(self, layer: Layer, pasted: bool = False) -> _Plot:
        """Openings of the solder mask, or of the stencil for paste."""
        for one in self.drawing.placed:
            for pad in one.part.pads:
                if on_layer(pad, one, layer) and (one.part.pasted or not pasted):
                    self._pad(one, pad, 0.0 if pasted else one.part.mask_mm)
        for hole in self.drawing.holes if not pasted else ():
            self.flash(f"C,{hole.drill:.6f}", hole.x, hole.y)
        return self

    def print(self, layer: Layer) -> _Plot:
        for stroke in self.drawing.strokes:
            if stroke.layer == layer:
                self.line(PRINT_MM, stroke.x1, stroke.y1, stroke.x2, stroke.y2)
        return self

    def edge(self) -> _Plot:
        for a, b in itertools.pairwise(self.drawing.edge()):
            self.line(EDGE_LINE_MM, *a, *b)
        return self


def _plated(drawing: Drawing) -> list[tuple[float, float, float]]:
    holes = [(VIA_DRILL_MM, via.x, via.y) for via in drawing.vias]
    for one in drawing.placed:
        holes += [(pad.drill, *one.spot(pad.x, pad.y)) for pad in one.part.pads if pad.drill]
    return holes


def _drill(drawing: Drawing, holes: list[tuple[float, float, float]], function: str) -> str:
    sizes = sorted({size for size, _, _ in holes})
    lines = ["M48", f"; #@! TF.FileFunction,{function}", "FMAT,2", "METRIC,TZ"]
    lines += [f"T{tool}C{size:.3f}" for tool, size in enumerate(sizes, 1)]
    lines += ["%", "G90", "G05"]
    for tool, size in enumerate(sizes, 1):
        lines.append(f"T{tool}")
        places = [drawing.corner(x, y) for one, x, y in holes if one == size]
        lines += [f"X{x:.6f}Y{y:.6f}" for x, y in places]
    return "\n".join([*lines, "T0", "M30"]) + "\n"


def _ipc(drawing: Drawing) -> Iterator[str]:
    """IPC-D-356A records of 80 columns, in units of 1 um."""
    yield "C  contactfpga"
    yield "P  JOB   contactfpga"
    yield "P  UNITS CUST 1"
    for one in drawing.placed:
        for pad in one.part.pads:
            net = one.nets.get(pad.number, "N/C")
            x, y = drawing.corner(*one.spot(pad.x, pad.y))
            if pad.drill:
                kind, hole, access = "317", f"D{round(pad.drill * 1e3):04d}P", "A00"
            else:
                kind, hole, access = "327", " " * 6, "A02" if one.back else "A01"
            size = "X{:04d}Y{:04d}".format(
                *(round(1e3 * side) for side in (one.size(pad) if not pad.round else (pad.width, 0)))
            )
            yield f"{kind}{net:<14}   {one.reference:<6}-{pad.number:<4} {hole}{access}{_ipc_at(x, y)}{size}R000 S0"
    for via in drawing.vias:
        hole = f"D{round(VIA_DRILL_MM * 1e3):04d}P"
        size = f"X{round(VIA_MM * 1e3):04d}Y0000"
        yield f"317{via.net:<14}   VIA   -     {hole}A00{_ipc_at(*drawing.corner(via.x, via.y))}{size}R000 S3"
    yield "999"


def _ipc_at(x: float, y: float) -> str:
    return f"X{round(1e3 * x):+07d}Y{round(1e3 * y):+07d}"
