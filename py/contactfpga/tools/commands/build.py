"""The command `contactfpga build`."""

from __future__ import annotations

import argparse
import dataclasses
import json
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from contactfpga import terminal
from contactfpga.boards import BOARDS, wiring
from contactfpga.boards.spec import BoardSpec, bitstream_path
from contactfpga.boards.wiring import Connection, Output, Wire, ohms
from contactfpga.design import buildable
from contactfpga.design.circuit import Circuit, CircuitError, check_times, load_checked, load_circuit
from contactfpga.design.sheet.parts import LVC595, LVC_OHM
from contactfpga.errors import UNSOLVED, ContactFPGAError
from contactfpga.skin import Skin
from contactfpga.skin.several import Several, sheets_of
from contactfpga.tools.console import flags, numbers, outputs, results

EXTRA = "boards"

BOARD = f"One of {', '.join(BOARDS)}, or module:attribute of your own BoardSpec."


def add_flags(flag: flags.Flags) -> None:
    flag("[BOARD]", f"{BOARD} With --kit it is the kit's.")
    flags.design(flag, "Skin to build (default: one that fits the board).")
    flags.output(flag, "Folder for the results (default: build/BOARD, or build/kits/NAME of a kit).", "DIR")
    flag("--seed N", "Seed of place and route.", numbers.whole(0, 2**31 - 1), 1)
    flag("--check", "Only say whether pins, clock, baud, circuit, size and speed go together, and which values would.")
    flag("--wiring", "Only print the wiring table; build nothing.")
    flags.json(flag)


def run(args: argparse.Namespace) -> int:
    """Run the command; :data:`UNSOLVED` if ``--check`` finds a misfit."""
    from contactfpga_hdl.board import sites

    board = flags.named_board(args)
    design = flags.designed(args, board.skin, board.load)
    if args.check:
        return _check(args, board, design)
    circuit = _circuit(args, board, design)
    board.check(design)
    table = WiringTable(board, design, circuit, sites.wire_sites(board, wiring.wires(board, design)))
    built = {} if args.wiring else _built(args, board, design)
    described = {"skin": design.changed} if isinstance(design, Skin) else {"sheets": _changed(design)}
    results.show(args, {"board": board.name, **described, **built, **table.to_dict()}, table.show)
    return 0


def _circuit(args: argparse.Namespace, board: BoardSpec, design: Skin | Several) -> Circuit | None:
    if isinstance(design, Several):
        return None
    circuit = load_checked(args.skin, design) if args.skin else Circuit(**board.circuit)
    if circuit is not None:
        try:
            check_times(circuit, design)
        except CircuitError as error:
            raise CircuitError(f"{args.skin or board.title}: {error}") from None
    return circuit


def _check(args: argparse.Namespace, board: BoardSpec, design: Skin | Several) -> int:
    from contactfpga_hdl.board import build

    if isinstance(design, Several):
        raise ContactFPGAError("--check takes one sheet; build several ones, which names the first thing that is wrong")
    circuit = load_circuit(args.skin) if args.skin else Circuit(**board.circuit)
    answer: dict[str, Any] = {"board": board.name, "problems": buildable.findings(board, design, circuit)}
    try:
        changes = buildable.proposed(board, design, circuit)
        with tempfile.TemporaryDirectory() as folder:
            report = build.build(design.replace(**changes), board, Path(folder), args.seed)
        answer |= {"changes": changes, "report": report}
    except (ContactFPGAError, build.BitstreamFailed) as error:
        answer["unsolved"] = str(error)
    size = report.lines() if "report" in answer else []
    results.show(args, answer, lambda: _show_check(board, answer, circuit is not None, size))
    return UNSOLVED if any(answer["problems"].values()) or "unsolved" in answer else 0


def _show_check(board: BoardSpec, answer: dict[str, Any], stated: bool, size: list[str]) -> None:
    terminal.say(board.title)
    for name, problem in answer["problems"].items():
        terminal.say(f"{name:13}{problem or 'fits'}", hang=13)
    if not stated:
        terminal.say(
            "circuit      not stated: add a table [circuit] and its levels and times are checked, too", hang=13
        )
    if "unsolved" in answer:
        terminal.say(f"no values were found that fit together: {answer['unsolved']}", hang=2)
        return
    if answer["changes"]:
        terminal.say("With these values in the Skin's file all of it fits:")
        for name, value in answer["changes"].items():
            terminal.say(f"    {name} = {json.dumps(value)}")
    for line in size:
        terminal.say(line)


def _changed(several: Several) -> list[dict[str, Any]]:
    return [skin.changed for skin in several.skins]


def _built(args: argparse.Namespace, board: BoardSpec, skin: Skin | Several) -> dict[str, Any]:
    from contactfpga_hdl.board import build

    folder = outputs.folder(args.output or default_folder(board, args.kit))
    try:
        report = build.build(skin, board, folder, args.seed)
    except build.BitstreamFailed as error:
        raise ContactFPGAError(str(error)) from None
    bitstream = str(bitstream_path(board, folder).resolve())
    if not args.json:
        print(f"{board.title}, {_described(skin)}", *report.lines(), sep="\n")
        print(f"{'bitstream':12} {bitstream}")
    return {"bitstream": bitstream, "report": report}


def _described(skin: Skin | Several) -> str:
    if isinstance(skin, Several):
        return f"sheets of {sheets_of(skin.skins)}"
    return f"{skin.rows}x{skin.columns}, report {skin.report!r}"


def default_folder(board: BoardSpec, kit: str | None) -> Path:
    return Path("build", "kits", kit) if kit else Path("build", board.name)


DIODES = {
    "col2row": "each diode's cathode toward the row",
    "row2col": "each diode's cathode toward the column",
    "none": "no diodes",
}


@dataclasses.dataclass(frozen=True)
class WiringTable:
    """All wires of one or several sheets on a board, with the circuit's values."""

    board: BoardSpec
    skin: Skin | Several
    circuit: Circuit | None
    """None: the Skin's file has no table ``[circuit]``, so resistors have no values."""
    sites: Sequence[str]

    def show(self) -> None:
        for sheet, skin in self._sheets:
            terminal.say(
                f"{self.board.title}, {sheet and f'sheet {sheet}: '}{skin.rows}x{skin.columns}, rows {skin.row_drive}, "
                f"columns {skin.column_read}, {skin.diodes}: {DIODES[skin.diodes]}"
            )
        head = ("wire", "pin", "FPGA", "leads to", "series", "pull")
        rows = [
            (wire.port, self.board.label(wire.pin) if wire.pin else "", site, *self._end(wire.line))
            for wire, site in zip(wiring.wires(self.board, self.skin), self.sites, strict=True)
        ]
        _show([head, *rows])
        chips = ("sheet", "chip", "chain", "number", "output", "leads to", "series", "pull")
        _show([chips, *((sheet, *one.place, *self._end(one.line)) for sheet, one in self._outputs())])
        for sheet, skin in self._sheets:
            counted = ", ".join(f"{count} {name}" for name, count in wiring.parts(skin).items())
            terminal.say(f"{sheet and f'sheet {sheet}: '}{counted}", hang=2)
        if (
            self.circuit
            and self.circuit.pin_ohm <= LVC_OHM
            and any(one.chip == "74HC595" for _, one in self._outputs())
        ):
            terminal.say(
                f"Each 74HC595 is a {LVC595.order.partition(',')[0]}, with the same pins: pin_ohm asks for it."
            )
        if self.circuit is None:
            terminal.say("Resistors have values once the Skin's file states them in its table [circuit].", hang=2)
        terminal.say("Join the grounds of board and sheet. No line may see more than 3.3 V.", hang=2)

    def to_dict(self) -> dict[str, Any]:
        """The table for JSON; ohms are null if nothing is fitted or stated."""
        return {
            "wires": [
                {"wire": wire.port, "pin": self.board.label(wire.pin) if wire.pin else None, "fpga": site}
                | self._dict(wire)
                for wire, site in zip(wiring.wires(self.board, self.skin), self.sites, strict=True)
            ],
            "parts": [wiring.parts(skin) for _, skin in self._sheets],
            "outputs": [
                ({"sheet": int(sheet)} if sheet else {})
                | {"chip": one.chip, "chain": one.chain, "number": one.number, "output": one.name, "pin": one.pin}
                | self._dict(one)
                for sheet, one in self._outputs()
            ],
        }

    @property
    def _sheets(self) -> list[tuple[str, Skin]]:
        if isinstance(self.skin, Several):
            return [(str(number), skin) for number, skin in enumerate(self.skin.skins)]
        return [("", self.skin)]

    def _outputs(self) -> list[tuple[str, Output]]:
        return [(sheet, one) for sheet, skin in self._sheets for one in wiring.outputs(skin)]

    def _dict(self, one: Wire | Output) -> dict[str, Any]:
        line = one.line
        pull = {"to": line.pull, "ohm": self._pull_ohm(line)} if line.pull else None
        return {"leads_to": line.leads_to, "series_ohm": self._series_ohm(line), "pull": pull}

    def _end(self, line: Connection) -> tuple[str, str, str]:
        series, pull = self._series_ohm(line), self._pull_ohm(line)
        to = {"up": "to 3.3 V", "down": "to ground", "": ""}[line.pull]
        return (
            line.leads_to,
            "" if series is None else ohms(series),
            to if pull is None else f"{ohms(pull)} {to}",
        )

    def _series_ohm(self, line: Connection) -> float | None:
        return self.circuit.series_ohm or None if self.circuit and line.kind else None

    def _pull_ohm(self, line: Connection) -> float | None:
        if self.circuit is None or not line.pull:
            return None
        return self.circuit.row_pull_ohm if line.kind == "row" else self.circuit.column_pull_ohm


def _show(rows: Sequence[Sequence[str]]) -> None:
    from contactfpga.tools.console import tables  # JSON needs no display

    if len(rows) > 1:
        filled = [column for column in zip(*rows, strict=True) if any(column[1:])]
        tables.show(list(zip(*filled, strict=True)), texts=range(len(filled)))
