"""Writes all files of a sheet into a folder."""

from __future__ import annotations

import dataclasses
import io
import itertools
import re
import tomllib
import zipfile
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from contactfpga.boards import wiring
from contactfpga.design.circuit import Circuit
from contactfpga.design.sheet import gerber, kicad, orders, picture, tube
from contactfpga.design.sheet.caps import Caps, feet, stl
from contactfpga.design.sheet.drawing import BOARDS, GND
from contactfpga.design.sheet.layout import Layout
from contactfpga.design.sheet.parts import SheetError

NAME = "sheet"


def write(folder: Path, layout: Layout, caps: Caps | None, skin_file: str, pad_mm: float | None = None) -> list[str]:
    """Write the files, ``skin_file`` as ``skin.toml``, and return their names; the same sheet gives the same bytes.
    ``caps``: None for combs. ``pad_mm``: side of the pads below the board, if it lies on some."""
    drawing, skin = layout.drawing, layout.skin
    title = f"contactfpga sheet {skin.rows}x{skin.columns} {skin.fingerprint.hex()}"
    order = {**gerber.files(drawing, NAME), "fabrication.txt": orders.note(layout)}
    contents = {
        f"{NAME}-board.zip": packed(order),
        f"{NAME}-bom.csv": orders.parts_list(layout).encode(),
        f"{NAME}-cpl.csv": orders.placement_list(layout).encode(),
        f"{NAME}-assembly.svg": picture.assembly(drawing, title).encode(),
        f"{NAME}-connectors.csv": connectors_list(layout).encode(),
        f"{NAME}.kicad_pcb": kicad.board(drawing, title, BOARDS[skin.surface][0]).encode(),
        f"{NAME}.kicad_pro": kicad.project(NAME).encode(),
        f"{NAME}.net": kicad.netlist(drawing).encode(),
        f"{NAME}.svg": picture.svg(drawing, title).encode(),
        "skin.toml": skin_file.encode(),
    }
    if caps is not None:
        contents[f"{NAME}-caps.stl"] = stl(caps.caps())
    if caps is not None and (frame := caps.frame()) is not None:
        contents[f"{NAME}-frame.stl"] = stl(frame)
    if skin.closed:
        contents[f"{NAME}-clamp.stl"] = stl(tube.clamps(skin, drawing.tab_mm))
    if pad_mm is not None:
        contents[f"{NAME}-feet.stl"] = stl(feet(pad_mm))
    for name, content in contents.items():
        (folder / name).write_bytes(content)
    return sorted(contents)


def packed(texts: Mapping[str, str]) -> bytes:
    """A ZIP file with these texts, and the same bytes each time."""
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as file:
        for name, text in texts.items():
            file.writestr(zipfile.ZipInfo(name), text, zipfile.ZIP_DEFLATED)
    return data.getvalue()


def connectors_list(layout: Layout) -> str:
    """The :func:`connections` as CSV."""
    return orders.table(
        [("connector", "pin", "wire", "line", "board"), *itertools.chain(*connections(layout).values())]
    )


def connections(layout: Layout) -> dict[str, list[tuple[str, ...]]]:
    """The pins of each connector of the sheet, by its name: connector, number, wire as named by ``contactfpga build
    --wiring``, line, and for a board with single wires its pin. There a ground that follows no line stays ``open``, and
    under "" are the wires to other things, with their grounds."""
    board, ends = layout.board, {line.pin: line.net for line in layout.lines}
    wires = [wire for wire in wiring.wires(board, layout.skin) if wire.pin in board.printed] if board else []
    places = {wire.port: board.printed[wire.pin] for wire in wires if board}
    rails = {net: iter(pins) for net, pins in board.rails.items()} if board else {}
    found: dict[str, list[tuple[str, ...]]] = {}
    for one in (one for one in layout.drawing.placed if one.reference.startswith("J")):
        before = ""
        for pin, net in one.nets.items():
            rail = rails.get(net, iter(())) if net != GND or before in ends else iter(())
            place = places.pop(net, "") or next(rail, "open" if rails else "")
            found.setdefault(one.reference, []).append((one.reference, pin, net, ends.get(net, ""), place))
            before = net
    others: list[tuple[str, ...]] = [
        ("", "", wire.port, wire.line.leads_to, places[wire.port]) for wire in wires if wire.port in places
    ]
    others += [("", "", GND, "ground of these", place) for place in rails.get(GND, ())]
    if others:
        found[""] = others
    return found


def circuit_table(circuit: Circuit) -> str:
    values = {name: value for name, value in dataclasses.asdict(circuit).items() if value is not None}
    tables = {name: values.pop(name) for name in ("diode", "falling") if name in values}
    lines = ["[circuit]", *(f"{name} = {value!r}" for name, value in values.items())]
    for name, table in tables.items():
        lines += ["", f"[circuit.{name}]", *(f"{key} = {value!r}" for key, value in table.items())]
    return "\n".join(lines) + "\n"


def completed(text: str, circuit: Circuit, times_us: Mapping[str, float] = MappingProxyType({})) -> str:
    """The text of a Skin's file in which the circuit and these times are replaced.

    Raises :class:`SheetError` if the file has its circuit not as a table with a header, or a time not on a line of its
    own.
    """
    for name, us in times_us.items():
        text, count = re.subn(rf"^(\s*{name}\s*=\s*)[\d.eE_+-]+", rf"\g<1>{us:g}", text, flags=re.MULTILINE)
        text = text if count else f"{name} = {us:g}\n{text}"
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
    whole.pop("circuit", None)
    if whole != before or any(whole[name] != us for name, us in times_us.items()):
        raise SheetError(
            "the Skin's file has its circuit in a form that cannot be replaced; write it as a table [circuit], and "
            "times on lines of their own"
        )
    return found
