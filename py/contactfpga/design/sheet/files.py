"""Writes all files of a sheet into a folder."""

from __future__ import annotations

import collections
import csv
import dataclasses
import io
import re
import tomllib
from collections.abc import Iterable
from pathlib import Path

from contactfpga.design.circuit import Circuit
from contactfpga.design.sheet import gerber, kicad, picture
from contactfpga.design.sheet.caps import Caps
from contactfpga.design.sheet.drawing import BOARDS
from contactfpga.design.sheet.layout import Layout
from contactfpga.design.sheet.parts import SheetError

NAME = "sheet"


def write(folder: Path, layout: Layout, caps: Caps, skin_file: str) -> list[str]:
    """Write the files, ``skin_file`` as ``skin.toml``, and return their names; the same sheet gives the same bytes."""
    drawing, skin = layout.drawing, layout.skin
    title = f"contactfpga sheet {skin.rows}x{skin.columns} {skin.fingerprint.hex()}"
    texts = {
        f"{NAME}.kicad_pcb": kicad.board(drawing, title, BOARDS[skin.surface][0]),
        f"{NAME}.kicad_pro": kicad.project(NAME),
        f"{NAME}.net": kicad.netlist(drawing),
        **gerber.files(drawing, NAME),
        f"{NAME}-parts.csv": parts_list(layout),
        f"{NAME}-placement.csv": placement_list(layout),
        f"{NAME}-connectors.csv": connectors_list(layout),
        f"{NAME}.svg": picture.svg(drawing, title),
        "skin.toml": skin_file,
    }
    for name, text in texts.items():
        (folder / name).write_bytes(text.encode())
    (folder / f"{NAME}-caps.stl").write_bytes(caps.stl())
    return sorted([*texts, f"{NAME}-caps.stl"])


def _table(rows: Iterable[Iterable[object]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def parts_list(layout: Layout) -> str:
    kinds: dict[tuple[str, str, str], list[str]] = collections.defaultdict(list)
    for one in layout.drawing.placed:
        kinds[one.value, one.part.name, one.part.order].append(one.reference)
    rows = [(len(names), value, part, " ".join(names), order) for (value, part, order), names in kinds.items()]
    return _table([("quantity", "value", "footprint", "references", "order"), *rows])


def placement_list(layout: Layout) -> str:
    """The placement list as CSV, in mm from cell (row 0, column 0), y up, and rotation counterclockwise from the top
    side."""
    rows = [
        (
            one.reference,
            one.value,
            one.part.name,
            f"{one.x:.4f}",
            f"{-one.y + 0.0:.4f}",
            one.turn,
            "bottom" if one.back else "top",
        )
        for one in layout.drawing.placed
    ]
    return _table([("reference", "value", "footprint", "x_mm", "y_mm", "turn_deg", "side"), *rows])


def connectors_list(layout: Layout) -> str:
    """The connector list as CSV: the board wire of each pin, named as by ``contactfpga build --wiring``."""
    plugs = [one for one in layout.drawing.placed if one.reference.startswith("J")]
    ends = {line.pin: line.net for line in layout.lines}
    rows = [(one.reference, pin, net, ends.get(net, "")) for one in plugs for pin, net in one.nets.items()]
    return _table([("connector", "pin", "wire", "line"), *rows])


def circuit_table(circuit: Circuit) -> str:
    values = dataclasses.asdict(circuit)
    diode = values.pop("diode")
    lines = ["[circuit]", *(f"{name} = {value!r}" for name, value in values.items())]
    lines += ["", "[circuit.diode]", *(f"{name} = {value!r}" for name, value in diode.items())]
    return "\n".join(lines) + "\n"


def completed(text: str, circuit: Circuit) -> str:
    """A Skin's file with its circuit replaced. Raises :class:`SheetError` if ``circuit`` is no table with a header."""
    kept, inside = [], False
    for line in text.splitlines():
        if re.match(r"\s*\[", line):
            inside = re.match(r"\s*\[\s*circuit\s*[].]", line) is not None
        if not inside:
            kept.append(line)
    found = "\n".join(kept).rstrip() + "\n\n" + circuit_table(circuit)
    try:
        whole = tomllib.loads(found)
    except tomllib.TOMLDecodeError:
        whole = {}
    before = tomllib.loads(text)
    before.pop("circuit", None)
    if {name: value for name, value in whole.items() if name != "circuit"} != before:
        raise SheetError(
            "the Skin's file has its circuit in a form that cannot be replaced; write it as a table [circuit]"
        )
    return found
