"""The command `contactfpga sheet`."""

from __future__ import annotations

import argparse
import collections
import dataclasses
import itertools
from pathlib import Path
from typing import Any

from contactfpga import terminal
from contactfpga.design import kits
from contactfpga.design.circuit import Circuit, falling, load_checked, needed_by, recommended_us
from contactfpga.design.cover import load_cover
from contactfpga.design.sheet import SWITCHES, lay_out
from contactfpga.design.sheet.drawing import CLEARANCE_MM, TRACK_MM, VIA_DRILL_MM, VIA_MM
from contactfpga.design.sheet.layout import MARGIN_MM
from contactfpga.errors import ContactFPGAError
from contactfpga.inputs.values import shell_words
from contactfpga.skin import Skin
from contactfpga.tools.console import flags, numbers, outputs, results

EXTRA = None


def add_flags(flag: flags.Flags) -> None:
    flag("[SKIN.toml]", "Skin to lay out, with its tables [circuit] and [cover].")
    flags.kit(flag)
    flags.output_folder(flag, "build/sheet")
    part = "Switch of each cell (default: dome): dome, a metal dome of 5 mm and 0.4 N; tact, a tact switch of 1 N. "
    flag(
        "--part", f"{part}A Skin with a ruler has combs of copper for a resistive film instead.", tuple(SWITCHES), None
    )
    flag("--board NAME", "Board whose PMOD sockets the headers are for; a kit has its own.")
    flag("--edge-mm MM", "Board beyond the parts, in mm.", numbers.number(MARGIN_MM, 100, "mm"), MARGIN_MM)
    flag("--cable M", "Length of the ribbon cables, in m.", numbers.number(0, 10, "m"), 0.3)
    flag("--kicad", "Have KiCad 6 check the board; status 1 if it finds anything.")
    flags.json(flag)


def run(args: argparse.Namespace) -> int:
    """Run the command; returns 1 if KiCad was run and found something."""
    from contactfpga.design.sheet import check, files, houses, tube
    from contactfpga.design.sheet.caps import caps
    from contactfpga.design.sheet.extract import extracted

    folder, file = outputs.folder(args.output), flags.sheet_file(args)
    if file is None:
        raise ContactFPGAError(f"name a Skin's file, or a kit: --kit {' or --kit '.join(kits.names())}")
    skin = Skin.load(file)
    cover, circuit = load_cover(file), load_checked(file, skin)
    layout = lay_out(skin, circuit, args.part, args.edge_mm, flags.board(args))
    side_mm = cover.cap.side_m * 1e3 if cover and cover.cap else None
    layer = None if skin.ruler else caps(skin, layout.switch, side_mm)
    found = extracted(layout, args.cable)
    times = _times(skin, found.circuit)
    longer = {name: us for name, us in times.items() if us is not None}
    text = files.completed(Path(file).read_text(encoding="utf-8-sig"), found.circuit, longer)
    if args.kicad:
        check.require()
    names = files.write(folder, layout, layer, text, cover.bed.pad_mm if cover and cover.bed else None)
    problems = check.findings(folder / f"{files.NAME}.kicad_pcb") if args.kicad else None
    left, top, right, bottom = layout.drawing.bounds()
    placed = [one for one in layout.drawing.placed if one.value]
    by_hand = [one.part.order for one in placed if not one.part.soldered]
    note = tube.note(skin) if skin.surface == "cylinder" else houses.too_large(right - left, bottom - top)
    answer: dict[str, Any] = {
        "folder": str(folder),
        "files": names,
        "board_mm": [round(right - left, 3), round(bottom - top, 3)],
        "note": note,
        "by_hand": collections.Counter(by_hand),
        "parts": collections.Counter(one.part.name for one in placed),
        "caps": layer
        and {
            "count": skin.rows * skin.columns - len(set(skin.mask)),
            "side_mm": round(layer.side_mm, 6),
            "gap_mm": round(layer.gap_mm, 6),
            "plunger_mm": layer.switch.closed_by,
            "sinks_mm": layer.sinks_mm if f"{files.NAME}-frame.stl" in names else None,
        },
        "wiring": files.connections(layout) if layout.board and layout.board.rails else {},
        "circuit": {
            name: getattr(found.circuit, name) for name in ("line_pf", "crossing_pf", "neighbor_pf", "line_ohm")
        },
        "times": {name: {"given": getattr(skin, name), "needed": us} for name, us in times.items()},
        "extracted": {name: value for name, value in dataclasses.asdict(found).items() if name != "circuit"},
        "kicad": problems,
    }
    results.show(args, answer, lambda: _show(answer, skin))
    return 1 if problems else 0


def _times(skin: Skin, circuit: Circuit) -> dict[str, float | None]:
    """Times of the Skin that are too short for the sheet's circuit, with what it needs; None if no time suffices."""
    if skin.diodes == "none":
        return {}  # not in the model
    if circuit.falling:
        falling.check(circuit, skin)
        return {}
    wanted = recommended_us(skin, needed_by(skin, circuit))
    return {name: us for name, us in wanted.items() if us is None or getattr(skin, name) < us}


def _show(answer: dict[str, Any], skin: Skin) -> None:
    width, height = answer["board_mm"]
    terminal.say(
        f"{skin.rows}x{skin.columns} at {skin.pitch_x_mm:.4g} x {skin.pitch_y_mm:.4g} mm: board of {width:.1f} x "
        f"{height:.1f} mm, two copper layers, tracks and clearances of {TRACK_MM} and {CLEARANCE_MM} mm, vias of "
        f"{VIA_MM}/{VIA_DRILL_MM} mm",
        hang=2,
    )
    if answer["note"]:
        terminal.say(f"note: {answer['note']}", hang=2)
    terminal.say("parts: " + ", ".join(f"{count} {name}" for name, count in answer["parts"].items()), hang=2)
    for words, count in answer["by_hand"].items():
        terminal.say(f"laid by hand, so in no file for the assembler: {count} of: {words}", hang=2)
    if cap := answer["caps"]:
        framed = "without a frame, for which the switches are too close or the board too bent"
        if cap["sinks_mm"] is not None:
            framed = f"in the frame an edge drops by {cap['sinks_mm']:.3g} mm at most as a cap tilts"
        terminal.say(
            f"caps: {cap['count']} of {cap['side_mm']:g} mm, {cap['gap_mm']:g} mm apart, on plungers of "
            f"{cap['plunger_mm']:g} mm; {framed}",
            hang=2,
        )
    else:
        terminal.say("combs of bare copper in each cell, below one film; no caps", hang=2)
    if answer["wiring"]:
        terminal.say(
            "wires: pin of the sheet, name, pin of the board by its print or number; last, those without the sheet"
        )
    for line in itertools.zip_longest(*answer["wiring"].values(), fillvalue=[""] * 5):
        cells = (f"{connector:3}{pin:4}{wire:12}{place:10}" for connector, pin, wire, _, place in line)
        terminal.say(f"  {''.join(cells)}".rstrip())
    found = answer["extracted"]
    terminal.say(
        "lines: rows {:.2f} to {:.2f} ohm, columns {:.2f} to {:.2f} ohm; a row to a column {:.2f} to {:.2f} pF, to the "
        "next row {:.2f} pF, a column to the next {:.2f} pF".format(
            *found["row_ohm"],
            *found["column_ohm"],
            *found["crossing_pf"],
            found["row_neighbor_pf"],
            found["column_neighbor_pf"],
        ),
        hang=2,
    )
    for name, value in answer["circuit"].items():
        terminal.say(f"  {name} = {value:g}")
    for name, one in answer["times"].items():
        never = "no time is enough for this circuit, and the next command says why"
        words = never if one["needed"] is None else f"this circuit needs {one['needed']:g}, and skin.toml has it"
        terminal.say(f"{name} was {one['given']:g}; {words}", hang=2)
    terminal.say(
        f"wrote {len(answer['files'])} files into {answer['folder']}; skin.toml has the completed [circuit]", hang=2
    )
    step = "wire --rest" if skin.ruler else "settle"
    terminal.say(f"next: contactfpga {step} --skin {shell_words(Path(answer['folder'], 'skin.toml'))}", hang=2)
    if answer["kicad"] is not None:
        terminal.say(f"KiCad: {len(answer['kicad'])} findings")
        for finding in answer["kicad"]:
            terminal.say(f"  {finding}", hang=4)
