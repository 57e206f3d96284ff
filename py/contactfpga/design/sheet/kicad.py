"""A layout as a board of KiCad 6, with its project and netlist.

The files are S-expressions (https://dev-docs.kicad.org/en/file-formats/sexpr-pcb). UUIDs are hashes, so the same sheet
gives the same files.
"""

from __future__ import annotations

import itertools
import json
import uuid
from collections.abc import Iterable, Iterator

from contactfpga.design.sheet.drawing import (
    CLEARANCE_MM,
    EDGE_MM,
    PRINT_MM,
    TRACK_MM,
    VIA_DRILL_MM,
    VIA_MM,
    Drawing,
    PlacedPart,
    rounded,
)
from contactfpga.design.sheet.parts import MASK_MM

SPACE = uuid.UUID("6f3b7d5e-8f0c-5b0e-9b2a-2f6f6a2d7c11")
PAGE_MM = 30.0

_LAYERS = (
    (0, "F.Cu", "signal"),
    (31, "B.Cu", "signal"),
    (34, "B.Paste", "user"),
    (35, "F.Paste", "user"),
    (36, "B.SilkS", "user"),
    (37, "F.SilkS", "user"),
    (38, "B.Mask", "user"),
    (39, "F.Mask", "user"),
    (44, "Edge.Cuts", "user"),
    (46, "B.CrtYd", "user"),
    (47, "F.CrtYd", "user"),
    (48, "B.Fab", "user"),
    (49, "F.Fab", "user"),
)


def _form(*items: object) -> str:
    return f"({' '.join(str(item) for item in items)})"


def _text(words: object) -> str:
    return json.dumps(str(words), ensure_ascii=False)


def _mm(value: float) -> str:
    return f"{rounded(value):.6f}".rstrip("0").rstrip(".")


class _Writer:
    def __init__(self, drawing: Drawing, title: str, thickness_mm: float):
        self.drawing, self.title, self.thickness_mm = drawing, title, thickness_mm
        left, top, _, _ = drawing.outline
        self.dx, self.dy = PAGE_MM - left, PAGE_MM - top
        self.numbers = {net: number for number, net in enumerate(drawing.nets(), 1)}

    def stamp(self, *what: object) -> str:
        return _form("tstamp", uuid.uuid5(SPACE, " ".join(map(str, (self.title, *what)))))

    def at(self, name: str, x: float, y: float) -> str:
        return _form(name, _mm(x + self.dx), _mm(y + self.dy))

    def board(self) -> Iterator[str]:
        yield "(kicad_pcb (version 20211014) (generator contactfpga)"
        yield _form("general", _form("thickness", self.thickness_mm))
        left, top, right, bottom = self.drawing.bounds()
        yield _form("paper", _text("User"), _mm(right - left + 2 * PAGE_MM), _mm(bottom - top + 2 * PAGE_MM))
        yield _form("title_block", _form("title", _text(self.title)))
        yield _form("layers", *(_form(number, _text(name), kind) for number, name, kind in _LAYERS))
        yield _form("setup", _form("pad_to_mask_clearance", MASK_MM))
        yield _form("net", 0, _text(""))
        for net, number in self.numbers.items():
            yield _form("net", number, _text(net))
        for one in self.drawing.placed:
            yield from self._footprint(one)
        yield from self._copper()
        yield from self._graphics()
        yield ")"

    def _footprint(self, one: PlacedPart) -> Iterator[str]:
        side = "B" if one.back else "F"
        name, stamp = one.reference, self.stamp
        at = _form("at", _mm(one.x + self.dx), _mm(one.y + self.dy), one.turn)
        footprint = _text(f"contactfpga:{one.part.name}")
        yield f"(footprint {footprint} (layer {_text(side + '.Cu')}) {stamp(name)} {at}"
        if not any(pad.drill for pad in one.part.pads):
            yield "(attr smd)"
        else:
            yield "(attr through_hole)"
        effects = "(effects (font (size 0.8 0.8) (thickness 0.12))" + (" (justify mirror))" if one.back else ")")
        for kind, words in (("reference", name), ("value", one.value)):
            layer = _form("layer", _text(side + ".Fab"))
            yield _form("fp_text", kind, _text(words), "(at 0 0)", layer, "hide", effects, stamp(name, kind))
        w, h = one.part.width / 2, one.part.height / 2
        corners = _form("start", _mm(-w), _mm(-h)), _form("end", _mm(w), _mm(h))
        layer = _form("layer", _text(side + ".CrtYd"))
        yield _form("fp_rect", *corners, layer, "(width 0.05)", "(fill none)", stamp(name, "area"))
        for index, pad in enumerate(one.part.pads):
            y = -pad.y if one.back else pad.y
            at = _form("at", _mm(pad.x), _mm(y), one.turn) if one.turn else _form("at", _mm(pad.x), _mm(y))
            shape = "circle" if pad.round else "rect"
            kind, layers = "thru_hole", ["*.Cu", "*.Mask"]
            if not pad.drill:
                kind, layers = "smd", [f"{side}.Cu", *([f"{side}.Paste"] if one.part.pasted else []), f"{side}.Mask"]
            drill = [_form("drill", _mm(pad.drill))] if pad.drill else []
            net = one.nets.get(pad.number)
            of = [_form("net", self.numbers[net], _text(net))] if net else []
            size = _form("size", _mm(pad.width), _mm(pad.height))
            of_layers = _form("layers", *map(_text, layers))
            mask = [] if one.part.mask_mm == MASK_MM else [_form("solder_mask_margin", one.part.mask_mm)]
            words = _form("pad", _text(pad.number), kind, shape, at, size, *drill, of_layers, *of, *mask)
            yield f"{words[:-1]} {stamp(name, 'pad', index)})"
        yield ")"

    def _copper(self) -> Iterator[str]:
        for index, track in enumerate(self.drawing.tracks):
            ends = self.at("start", track.x1, track.y1), self.at("end", track.x2, track.y2)
            layer = _form("layer", _text(f"{track.layer}.Cu"))
            net = _form("net", self.numbers[track.net])
            yield _form("segment", *ends, _form("width", track.width), layer, net, self.stamp("track", index))
        for index, via in enumerate(self.drawing.vias):
            size = _form("size", VIA_MM), _form("drill", VIA_DRILL_MM)
            net = _form("net", self.numbers[via.net])
            layers = '(layers "F.Cu" "B.Cu")'
            yield _form("via", self.at("at", via.x, via.y), *size, layers, net, self.stamp("via", index))

    def _graphics(self) -> Iterator[str]:
        for index, stroke in enumerate(self.drawing.strokes):
            layer = f"{stroke.layer}.SilkS"
            yield self._line((stroke.x1, stroke.y1), (stroke.x2, stroke.y2), layer, PRINT_MM, ("print", index))
        for index, (a, b) in enumerate(itertools.pairwise(self.drawing.edge())):
            yield self._line(a, b, "Edge.Cuts", 0.1, ("edge", index))
        for index, hole in enumerate(self.drawing.holes, 1):
            name, size = f"H{index}", _mm(hole.drill)
            at = self.at("at", hole.x, hole.y)
            yield f'(footprint "contactfpga:M3" (layer "F.Cu") {self.stamp(name)} {at}'
            yield "(attr exclude_from_pos_files exclude_from_bom)"
            for kind, words in (("reference", name), ("value", "M3")):
                font = "(effects (font (size 0.8 0.8) (thickness 0.12)))"
                yield _form(
                    "fp_text", kind, _text(words), "(at 0 0)", '(layer "F.Fab")', "hide", font, self.stamp(name, kind)
                )
            form = f'np_thru_hole circle (at 0 0) (size {size} {size}) (drill {size}) (layers "*.Cu" "*.Mask")'
            yield f'(pad "" {form} {self.stamp(name, "pad")}))'

    def _line(
        self, a: tuple[float, float], b: tuple[float, float], layer: str, width: float, what: Iterable[object]
    ) -> str:
        ends = self.at("start", *a), self.at("end", *b)
        return _form("gr_line", *ends, _form("layer", _text(layer)), _form("width", width), self.stamp(*what))


def board(drawing: Drawing, title: str, thickness_mm: float = 1.6) -> str:
    return "\n".join(_Writer(drawing, title, thickness_mm).board()) + "\n"


def project(name: str) -> str:
    """The text of the .kicad_pro file, with the board's design rules."""
    rules = {
        "min_clearance": CLEARANCE_MM,
        "min_copper_edge_clearance": EDGE_MM,
        "min_hole_clearance": 0.25,
        "min_hole_to_hole": 0.25,
        "min_through_hole_diameter": VIA_DRILL_MM,
        "min_track_width": TRACK_MM,
        "min_via_annular_width": (VIA_MM - VIA_DRILL_MM) / 2,
        "min_via_diameter": VIA_MM,
    }
    usual = {
        "name": "Default",
        "clearance": CLEARANCE_MM,
        "track_width": TRACK_MM,
        "via_diameter": VIA_MM,
        "via_drill": VIA_DRILL_MM,
    }
    content = {
        "board": {"design_settings": {"rules": rules}},
        "meta": {"filename": f"{name}.kicad_pro", "version": 1},
        "net_settings": {"classes": [usual], "meta": {"version": 2}},
    }
    return json.dumps(content, indent=2) + "\n"


def netlist(drawing: Drawing) -> str:
    """The text of the netlist: the net of each pad."""
    parts = [
        _form("comp", _form("ref", _text(one.reference)), _form("value", _text(one.value)),
              _form("footprint", _text(f"contactfpga:{one.part.name}")))
        for one in drawing.placed
    ]  # fmt: skip
    nodes: dict[str, list[str]] = {net: [] for net in drawing.nets()}
    for one in drawing.placed:
        for number, net in one.nets.items():
            nodes[net].append(_form("node", _form("ref", _text(one.reference)), _form("pin", _text(number))))
    nets = [
        "\n  ".join([f"(net (code {_text(code)}) (name {_text(net)})", *joined]) + ")"
        for code, (net, joined) in enumerate(nodes.items(), 1)
    ]
    lines = ['(export (version "E")', "(components", *parts, ")", "(nets", *nets, "))"]
    return "\n".join(lines) + "\n"
