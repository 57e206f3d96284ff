"""The command `contactfpga bringup`."""

from __future__ import annotations

import argparse
import datetime
import math
import statistics
import sys
from collections.abc import Iterator

from contactfpga import terminal
from contactfpga.design import kits, predictions
from contactfpga.design.circuit import load_circuit
from contactfpga.design.circuit.fit import PROBABILITY
from contactfpga.design.cover import load_cover
from contactfpga.design.cover.fitted import FittedForce, fit_force
from contactfpga.design.kits import Kit
from contactfpga.design.sheet.extract import extracted
from contactfpga.driver import driver
from contactfpga.driver.board import Board
from contactfpga.driver.health import Finding
from contactfpga.driver.transport import SimulatedPort
from contactfpga.errors import ContactFPGAError, SkinMismatch
from contactfpga.inputs.files import write_text
from contactfpga.inputs.values import number_in, shell_words
from contactfpga.skin import Skin
from contactfpga.tools.commands.bringup import steps
from contactfpga.tools.commands.bringup.bench import Bench, Person, Step
from contactfpga.tools.commands.bringup.report import BringUpReport, graded
from contactfpga.tools.console import flags, interrupt, numbers, outputs, results

EXTRA = None

CLOSING = "closing_rod_n"
"""Closing forces of a rod: a finger's tell the finger as much as the switch."""
SECONDS = 300.0
"""Default longest duration of each step with touches."""
COUNTED_S = 2.0
"""Time for counting frames of an untouched sheet."""
LATER = 3
"""Times the settle time until which cells under weights are read."""
STUCK_S, REST_S = 10.0, 1.0
REHEARSAL = "sim://"
"""Port of a virtual kit with a simulated hand."""
REHEARSED_S, REHEARSED_LINK_S = 5.0, 0.15
"""Simulated times in s: longest constant action of the hand, and counting."""


def add_flags(flag: flags.Flags) -> None:
    port = "As for other commands; sim:// rehearses on a virtual board"
    flag("[PORT]", f"{port} (default: the supported board that is plugged in).")
    flags.kit(flag)
    own = "Write the Skin that bring-up needs to this new file and end: the kit's, but it sends every cell."
    flag("--skin-output FILE", own)
    flags.output(flag, "The report (default: bringup-NAME-DATE.md).")
    long = f"Seconds that each step with a touch lasts at most (default: {SECONDS:g}); Ctrl-C ends such a step."
    flag("--seconds S", long, numbers.SECONDS)
    flag("--timeout S", "Seconds to wait for the board.", numbers.SECONDS, 1.0)
    flag("--yes", "Do not wait for Enter before each step.")
    yours = "What you measured yourself of the kit's predictions, by scale, scope or meter; may be given several times."
    flag("--measured NAME=VALUE ...", yours, _measured, [])
    flags.json(flag, "Print one JSON object at the end, and nothing before it.")


def _measured(text: str) -> tuple[str, float]:
    name, equals, value = text.partition("=")
    number = number_in(value) if equals and name else math.nan
    if not math.isfinite(number):
        raise argparse.ArgumentTypeError(f"{numbers.shortened(text)!r} must be NAME=VALUE, with a finite number")
    return name, number


def run(args: argparse.Namespace) -> int:
    if not args.kit:
        raise ContactFPGAError(f"name a kit: --kit {' or '.join(kits.names())}")
    kit = kits.kit(args.kit)
    skin = bring_up_skin(kit)
    if args.skin_output:
        return _write_skin(kit, skin, args.skin_output)
    predicted = predictions.load(kit)
    _check_names(args.measured, predicted)
    when = datetime.date.today()
    path = outputs.file(args.output or f"bringup-{kit.name}-{when.isoformat()}.md")
    report = BringUpReport(kit, skin, when)
    report.force = _force(kit, predicted, args.measured)
    with interrupt.usual_end():
        _lead(args, kit, report)
    measured = {name: value for step in report.steps for name, value in step.measured.items()} | _medians(args.measured)
    report.grades = graded(predicted, measured)
    report.not_measured = [one for name, one in predicted.items() if name not in measured]
    write_text(path, report.to_markdown())
    if report.film is not None:
        write_text(path.with_suffix(".csv"), report.film.csv())
    results.show(args, report, lambda: _show_end(report, str(path), args.port == REHEARSAL))
    return min(report.faults, 1)


def bring_up_skin(kit: Kit) -> Skin:
    """The kit's Skin with all cells in each frame, and without debounce; with a ruler it has one level, and waits for
    lighter cells."""
    settle_us = kit.skin.settle_us * (LATER if kit.skin.ruler else 1)
    return kit.skin.replace(report="cells", debounce="none", send="always", harder=(), settle_us=settle_us)


def _write_skin(kit: Kit, skin: Skin, name: str) -> int:
    path = outputs.file(name, "--skin-output")
    text = kit.skin_path.read_text(encoding="utf-8-sig")
    tables = text[text.index("\n[") :] if "\n[" in text else ""
    write_text(
        path, f"# The {kit.name} kit's Skin for `contactfpga bringup`: it sends every cell.\n{skin.to_toml()}{tables}"
    )
    board = kit.board.name
    terminal.say(
        f"{path} is written. Next: {shell_words('contactfpga', 'build', board, '--skin', path)}, "
        f"contactfpga flash {board}, then contactfpga bringup --kit {kit.name}",
        hang=2,
    )
    return 0


def _check_names(measured: list[tuple[str, float]], predicted: dict[str, predictions.Prediction]) -> None:
    for name, _ in measured:
        if name not in predicted:
            known = ", ".join(predicted) or "none"
            raise ContactFPGAError(f"--measured {name}: the kit predicts nothing of this name; it predicts {known}")


def _medians(measured: list[tuple[str, float]]) -> dict[str, float]:
    return {name: statistics.median(value for other, value in measured if other == name) for name, _ in measured}


def _closing(measured: list[tuple[str, float]]) -> list[tuple[str, float]]:
    return [(name, value) for name, value in measured if name == CLOSING]


def _force(
    kit: Kit, predicted: dict[str, predictions.Prediction], measured: list[tuple[str, float]]
) -> FittedForce | None:
    """The switches' force by measured closing forces; None without any, or without a cover."""
    cover, closing = load_cover(kit.skin_path), _closing(measured)
    if cover is None or cover.cell or not closing:
        return None
    pairs = [(predicted[name].value, value) for name, value in closing]
    return fit_force(cover.switch.force_n, pairs, math.sqrt(PROBABILITY))


def _lead(args: argparse.Namespace, kit: Kit, report: BringUpReport) -> None:
    try:
        board, person = _opened(args, kit, report.skin)
    except (ContactFPGAError, OSError) as error:
        _add(
            args,
            report,
            Step("supply and link", (Finding("fault", str(error)),), stop="there is no board to ask"),
            args.port or "",
        )
        return
    with board:
        skin = board.skin
        if skin.report != "cells":
            report.skin = skin
            report.left_out.append(
                "switches, bounce, settle times and circuit: the board sends zones; `contactfpga bringup --kit "
                f"{kit.name} --skin-output FILE` writes the Skin that sends cells, then build and flash it"
            )
        bench = Bench(board, skin, person, load_circuit(kit.skin_path), COUNTED_S, args.timeout)
        bench.cover = load_cover(kit.skin_path)
        if _closing(args.measured):
            bench.probability = math.sqrt(PROBABILITY)  # the other half of the doubt is the cover's
        if isinstance(person, _Hand):
            bench.seconds = REHEARSED_LINK_S
        for step in _until_lost(steps.run(bench)):
            _add(args, report, step, board.port)
        report.fitted, report.film = bench.fitted, bench.film


def _until_lost(found: Iterator[Step]) -> Iterator[Step]:
    try:
        yield from found
    except ContactFPGAError as error:
        yield Step("end", (Finding("fault", str(error)),), stop="the board no longer answers as it should")


def _opened(args: argparse.Namespace, kit: Kit, skin: Skin) -> tuple[Board, Person]:
    person: Person = _Reader(args)
    port: str | SimulatedPort | None = args.port
    if port == REHEARSAL:
        person, port = _rehearsed(kit, skin)
    try:
        return driver.open(port, skin, timeout=args.timeout), person
    except SkinMismatch:
        return driver.open(port, kit.skin, timeout=args.timeout), person


def _rehearsed(kit: Kit, skin: Skin) -> tuple[Person, SimulatedPort]:
    from contactfpga_sim.model.board.virtual import VirtualBoard
    from contactfpga_sim.model.scenes.hand import Hand

    hand = Hand(skin.rows, skin.columns, skin.derived.frame_clocks / skin.clock_hz)
    circuit = extracted(kit.layout).circuit
    cover = load_cover(kit.skin_path) if circuit.falling else None
    return _Hand(hand), VirtualBoard(skin, hand, circuit=circuit, cover=cover)


class _Hand:
    stuck_s, rest_s = 0.1, 0.02

    def __init__(self, hand: object):
        self._hand = hand

    def asked(self, does: str, words: str) -> float:
        return self._hand.does(does) or REHEARSED_S  # type: ignore[attr-defined]


class _Reader:
    stuck_s, rest_s = STUCK_S, REST_S

    def __init__(self, args: argparse.Namespace):
        self._args = args

    def asked(self, does: str, words: str) -> float:
        waits = not self._args.yes and sys.stdin.isatty()
        enter = " Enter when you are ready;" if waits else ""
        terminal.say(f"      {words}{enter} Ctrl-C ends the step.", sys.stderr, hang=6)
        if waits:
            input()
        return self._args.seconds or SECONDS


def _add(args: argparse.Namespace, report: BringUpReport, step: Step, port: str) -> None:
    if not args.json:
        terminal.say(f"{len(report.steps) + 1}. {step.name}")
        for finding in step.findings:
            terminal.say(f"{finding.verdict:5} {finding.sentence}", hang=6)
        if step.stop:
            terminal.say(f"stop  {step.stop}", hang=6)
    plain = step.findings
    if port:
        plain = tuple(one._replace(sentence=one.sentence.replace(port, "the board")) for one in step.findings)
    report.steps.append(Step(step.name, plain, step.measured, step.stop))


def _show_end(report: BringUpReport, path: str, rehearsed: bool) -> None:
    for one in report.grades:
        said = one.prediction
        measured = f"{said.name} = {one.measured:.4g} {said.unit}, predicted {said.low:g} to {said.high:g}"
        terminal.say(f"{'ok' if one.holds else 'note':5} {measured}: {one.verdict}", hang=6)
    for what in report.left_out:
        terminal.say(f"note  left out: {what}", hang=6)
    faults = f"{report.faults} fault{'' if report.faults == 1 else 's'}"
    then = "a rehearsal, which nobody needs to see" if rehearsed else "open an issue with it, whatever it says"
    terminal.say(f"{faults}; the report is {path}: {then}", hang=2)
