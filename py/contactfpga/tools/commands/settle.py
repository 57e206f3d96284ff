"""The command `contactfpga settle`."""

from __future__ import annotations

import argparse
import dataclasses
from typing import Any

from contactfpga import helptext, terminal
from contactfpga.design import circuit as sheet
from contactfpga.design.circuit import DIODES, Circuit, CircuitError, Diode, Needs, Problem
from contactfpga.design.circuit.static import NOISE_V
from contactfpga.design.circuit.times import MARGIN, Time
from contactfpga.design.circuit.values import LIMITS
from contactfpga.errors import UNSOLVED
from contactfpga.skin import Skin
from contactfpga.tools.console import flags, numbers, results

EXTRA = None


def add_flags(flag: flags.Flags) -> None:
    skin = "Skin that gives rows, columns, diodes and the table [circuit]; flags below replace values of that table."
    flags.sheet(flag, skin)
    lines = numbers.whole(*Skin.limits("rows")[:2], "lines")
    flag("--rows N", "Number of rows (default: the Skin's, or 16).", lines)
    flag("--columns N", "Number of columns (default: the Skin's, or 16).", lines)
    flag("--diodes", "Direction of the diodes (default: the Skin's, or col2row).", ("col2row", "row2col"))
    usual = Circuit()
    values = flag.group("circuit")
    meanings = _meanings(Circuit)
    for name, (low, high, unit) in LIMITS.items():
        option = "--pf" if name == "line_pf" else _option(name)
        words = f"{meanings.get(name, '')} (default: {getattr(usual, name):g} {unit})."
        values(f"{option} {unit.upper()}", words, numbers.number(low, high, unit), dest=name)
    diode = flag.group("diode, as SPICE describes it (default: schottky)")
    diode("--diode", "Kind; it gives the values below that you leave out.", tuple(DIODES))
    meanings = _meanings(Diode)
    for one in dataclasses.fields(Diode):
        (low, high, *unit), spice = one.metadata["limits"], one.metadata["spice"]
        words = " ".join([f"{meanings.get(one.name, '')} (schottky: {getattr(usual.diode, one.name):g}", *unit]) + ")."
        diode(f"{_option(f'diode_{one.name}')} {spice}", words, numbers.number(low, high, *unit))
    flag("--margin FACTOR", "Recommended times are this many times those computed.", numbers.number(1, 10), MARGIN)
    flags.json(flag)


def _meanings(kind: type) -> dict[str, str]:
    """The first sentence on each field, without its period."""
    return {one.name: " ".join(one.text.split()).partition(". ")[0].rstrip(".") for one in helptext.fields(kind)}


def _option(name: str) -> str:
    return "--" + name.replace("_", "-")


def run(args: argparse.Namespace) -> int:
    """Run the command; :data:`UNSOLVED` if the sheet cannot work, no time suffices, or the Skin's are too short."""
    args.skin = flags.sheet_file(args)
    skin = Skin.load(args.skin) if args.skin else Skin()
    if skin.diodes == "none" and args.diodes is None:
        raise CircuitError("diodes is 'none'; the model is of sheets with a diode per switch")
    given = (sheet.load_circuit(args.skin) if args.skin else None) or Circuit()
    rows, columns = args.rows or skin.rows, args.columns or skin.columns
    diodes = args.diodes or skin.diodes
    values = _changed(given, args)
    lines = rows + skin.guard, columns + skin.guard
    needs = sheet.needed(values, *lines, diodes)
    projects = skin.reads_rows if args.skin else True
    problems = sheet.problems(values, *lines, diodes, projects)
    asked = {"rows": rows, "columns": columns, "guard": skin.guard, "diodes": diodes}
    answer = _answer(values, needs, problems, args.margin) | asked
    if args.skin:
        answer["skin"] = _given(skin, sheet.recommended_us(skin, needs, args.margin))
    results.show(args, answer, lambda: _show(answer, needs, args.margin))
    short = any(not one["enough"] for one in answer.get("skin", {}).values())
    return UNSOLVED if problems or short or None in answer.values() else 0


def _changed(given: Circuit, args: argparse.Namespace) -> Circuit:
    diode = DIODES[args.diode] if args.diode else given.diode
    fields = {one.name: getattr(args, f"diode_{one.name}") for one in dataclasses.fields(Diode)}
    changes: dict[str, Any] = {name: getattr(args, name) for name in LIMITS}
    changes["diode"] = Diode(**(dataclasses.asdict(diode) | _said(fields)))
    return given.replace(**_said(changes))


def _said(values: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in values.items() if value is not None}


def _answer(circuit: Circuit, needs: Needs, problems: list[Problem], margin: float) -> dict[str, Any]:
    times = ("precharge", "settle", "release", "project", "project_columns", "pulled_release")
    phases: dict[str, Time] = {name: getattr(needs, name) for name in times}
    return {
        **{f"{name}_us": time.us(margin) for name, time in phases.items()},
        "margin": margin,
        "worst": {
            name: {"pattern": time.pattern, "us": None if time.us(1) is None else round(1e6 * time.seconds, 5)}
            for name, time in phases.items()
        },
        "levels": {
            "pressed_v": round(needs.pressed.level_v, 4),
            "pressed_margin_v": round(needs.pressed.margin_v, 4),
            "unpressed_v": round(needs.unpressed_v, 4),
            "unpressed_margin_v": round(needs.unpressed_margin_v, 4),
            "touched_row_v": round(needs.touched.level_v, 4),
            "touched_row_margin_v": round(needs.touched.margin_v, 4),
        },
        "pins_ma": {
            "row": round(needs.pressed.pin_ma, 4),
            "projecting_column": round(needs.touched.pin_ma, 4),
            "row_peak": round(needs.row_peak_ma, 4),
            "column_peak": round(needs.column_peak_ma, 4),
        },
        "problems": problems,
        "circuit": {name: value for name, value in dataclasses.asdict(circuit).items() if value is not None},
    }


def _given(skin: Skin, wanted: dict[str, float | None]) -> dict[str, Any]:
    return {
        name: {
            "given": getattr(skin, name),
            "needed": needed,
            "enough": needed is not None and getattr(skin, name) >= needed,
        }
        for name, needed in wanted.items()
    }


TITLES = {
    "precharge": "columns drive to their released level",
    "settle": "a row is selected",
    "release": "row released, columns not yet driven",
    "project": "all columns driven, the rows are read",
    "pulled_release": "without precharge: the pulls lift the columns",
}


def _show(answer: dict[str, Any], needs: Needs, margin: float) -> None:
    guard = " and guard lines" if answer["guard"] else ""
    sheet_of = f"{answer['rows']}x{answer['columns']}{guard}, {answer['diodes']}"
    terminal.say(f"{sheet_of}; times with a margin of {margin:g}")
    lines = []
    for name, title in TITLES.items():
        key = "release_us" if name == "pulled_release" else f"{name}_us"
        time: Time = getattr(needs, name)
        us = answer[f"{name}_us"]
        value = "never" if us is None else f"{us:.2f}"
        computed = "" if us is None else f"{1e6 * time.seconds:.3f} computed, "
        lines.append((key, value, f"{title} ({computed}worst pattern: {time.pattern})"))
    for key, value, words in lines:
        terminal.say(f"{key:13}{value:>8}  {words}", hang=23)
    _show_levels(needs)
    for name, one in answer.get("skin", {}).items():
        what = "enough" if one["enough"] else f"too short, {_or_never(one['needed'])} needed"
        terminal.say(f"the Skin's {name} = {one['given']:g}: {what}")
    for problem in answer["problems"]:
        terminal.say(f"cannot work: {problem.what}; {problem.helps}", hang=2)


def _or_never(us: float | None) -> str:
    return "no time is" if us is None else f"{us:.2f}"


def _show_levels(needs: Needs) -> None:
    said = [
        ("pressed column", needs.pressed.level_v, needs.pressed.margin_v, "its whole row pressed"),
        ("other column", needs.unpressed_v, needs.unpressed_margin_v, "pulled by its neighbors after a precharge"),
        ("touched row", needs.touched.level_v, needs.touched.margin_v, "a projection, one column feeds all rows"),
    ]
    for title, level, margin_v, words in said:
        near = "" if margin_v >= NOISE_V else f", less than {NOISE_V}"
        terminal.say(f"{title:15}{level:6.2f} V  margin {margin_v:.2f} V{near} ({words})", hang=25)
    terminal.say(
        f"pins: row {needs.pressed.pin_ma:.2f} mA, projecting column {needs.touched.pin_ma:.2f} mA; pulses to "
        f"{max(needs.row_peak_ma, needs.column_peak_ma):.0f} mA while lines are charged",
        hang=2,
    )
