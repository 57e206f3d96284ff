"""A fit's result as table, text, JSON and Skin file."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Sequence
from typing import Any

from contactfpga import terminal
from contactfpga.design.circuit import write_circuit
from contactfpga.design.cover.press import write_cover
from contactfpga.tools.console import tables
from contactfpga_sim.apps import light
from contactfpga_sim.apps.errors import METRICS
from contactfpga_sim.apps.fit.candidates import Candidate
from contactfpga_sim.apps.fit.cost import DEVICE
from contactfpga_sim.apps.fit.sources import RecordingSource
from contactfpga_sim.apps.fit.trial import Fit, Measurement, Trial
from contactfpga_sim.apps.score import Interval
from contactfpga_sim.apps.speed import Speed

HEADS = ("zones by", "scan", "cover", "row us", "sheet", "pitch mm", "baud", "wires", "bytes", "latency us", "verdict")
"""Column headings; columns of equal values are omitted."""

SHEETS = 12
"""Refused sheets that get a line: the finest."""

METRIC_HEADS = ("scenes miscounted", "contacts missed", "barycenter", "area")


def printed(found: Fit) -> None:
    _print(rows(found), bold="the answer")
    _print(reported(found), keys=1)
    for line in notes(found):
        terminal.say(line)


def printed_so_far(trials: Iterable[Trial]) -> None:
    _print(rows_so_far(trials))


def _print(lines: Sequence[Sequence[str]], keys: int = 4, bold: str | None = None) -> None:
    styles = {number: "bold" for number, line in enumerate(lines[1:]) if line[-1] == bold}
    tables.show(lines, keys=keys, texts=[len(lines[0]) - 1] if keys > 1 else [], styles=styles)


def rows(fit: Fit) -> list[list[str]]:
    """The head, a line for the refused ones of each sheet with fewer wires and each cover on the answer's sheet, and
    the answer; without one a line per sheet, the nearest first, and the Skins that cannot exist."""
    lines = [_row(one, _why(one, of)) for one, of in _told(fit)]
    if fit.answer:
        lines.append(_row(fit.answer, "the answer"))
    else:
        lines += [_row_of(one, one.refusal) for one in fit.impossible]
    return _without_same([list(HEADS), *lines])


def _told(fit: Fit) -> list[tuple[Trial, int]]:
    """Refused trials for :func:`rows`, each with the number it represents; at most :data:`SHEETS` of other sheets than
    the answer's."""
    groups: dict[object, list[Trial]] = {}
    for one in fit.cheaper:
        key: object = (one.skin.rows, one.skin.columns)
        if fit.answer and one.cost[0] == fit.answer.cost[0]:
            key = one.candidate.cover if one.candidate.cover != fit.answer.candidate.cover else one.candidate
        groups.setdefault(key, []).append(one)
    told = [(min(group, key=lambda one: (one.excess, one.margin)), len(group)) for group in groups.values()]
    if fit.answer is None:
        return told[:SHEETS]
    coarser = [each for each in told if each[0].cost[0] < fit.answer.cost[0]]
    return coarser[-SHEETS:] + told[len(coarser) :]


def _why(trial: Trial, of: int) -> str:
    return (f"the nearest of {of}: " if of > 1 else "") + "; ".join(trial.refusals)


def _without_same(table: list[list[str]]) -> list[list[str]]:
    for name in ("scan", "cover", "baud"):
        place = table[0].index(name)
        if len({line[place] for line in table[1:]}) == 1:
            table = [line[:place] + line[place + 1 :] for line in table]
    return table


def rows_so_far(trials: Iterable[Trial]) -> list[list[str]]:
    nearest = sorted(trials, key=lambda one: (one.excess, one.cost))
    return _without_same([list(HEADS), *(_row(one, "; ".join(one.refusals) or "meets the limits") for one in nearest)])


def plain_so_far(trials: Iterable[Trial]) -> dict[str, Any]:
    return {"interrupted": True, "measured": [_trial(one) for one in sorted(trials, key=lambda one: one.excess)]}


def _row(trial: Trial, verdict: str) -> list[str]:
    speeds = [one.speed for one in trial.measured if one.speed]
    return _row_of(trial.candidate, verdict, _bytes(trial), _latency(speeds))


def _bytes(trial: Trial) -> str:
    return "" if math.isnan(trial.bytes) else f"{trial.bytes:g}"


def _latency(speeds: Sequence[Speed]) -> str:
    if not speeds:
        return ""
    return f"{max(one.median_us for one in speeds):.0f} / {max(one.worst_us for one in speeds):.0f}"


def _row_of(one: Candidate, verdict: str, size: str = "", latency: str = "") -> list[str]:
    settings, skin = dict(one.settings), one.skin
    pitches = dict.fromkeys(f"{settings[name]:.4g}" for name in ("pitch_x_mm", "pitch_y_mm"))
    sheet, row_us = f"{settings['rows']}x{settings['columns']}", ""
    if skin is not None:
        row_us = f"{1e6 * skin.derived.row_clocks / skin.clock_hz:.3g}"
    ways = (_method(settings), settings["scan"], settings.get("cover", "bare"), row_us)
    return [*ways, sheet, " x ".join(pitches), str(settings["baud"]), str(one.wires), size, latency, verdict]


def _method(settings: dict[str, Any]) -> str:
    if settings["report"] == "cells":
        return f"{settings['levels']} levels, host" if "levels" in settings else "cells, host"
    by = settings["labeller"]
    if "connectivity" in settings:
        by += f", {settings['connectivity']}"
    return by if settings["report"] == "moments" else f"{by}, {settings['report']}"


def name(trial: Trial) -> str:
    by, _, cover, _, sheet, pitch, *_ = _row_of(trial.candidate, "")
    return f"{by}, {sheet}, {pitch} mm, {cover}"


def reported(fit: Fit) -> list[list[str]]:
    """The head, and a line per Skin and source on other scenes."""
    feels = any("unfelt" in one.errors for one in fit.reported)
    metrics = [*METRICS, "unfelt"] if feels else METRICS
    felt = [f"not felt at {fit.task.goals.felt_n:g} N"] * feels
    table = [["on scenes not used to choose", "scenes", *METRIC_HEADS, *felt, "latency us"]]
    word = "the answer" if fit.answer else "the nearest"
    for source, one in zip(fit.task.names, fit.reported):
        errors = [_error(metric, one.errors[metric]) for metric in metrics]
        latency = _latency([one.speed] if one.speed else [])
        table.append([f"{word}, {source}", str(one.errors["miscounted"].count), *errors, latency])
    return table


def _error(metric: str, error: Interval) -> str:
    scale, unit = (1, " mm") if metric == "barycenter_mm" else (100, " %")
    low, high = (f"{max(0.0, scale * end):.2f}" for end in (error.low, error.high))
    return f"{scale * error.mean:.2f}{unit} ({low} to {high})"


def notes(fit: Fit) -> list[str]:
    lines = []
    if fit.answer is None:
        lines.append("No Skin that was tried meets the limits.")
        if fit.cheaper:
            lines.append(f"The nearest is {name(fit.cheaper[0])}; it misses: {'; '.join(fit.cheaper[0].refusals)}")
    if fit.broken:
        lines.append(f"On scenes not used to choose the answer misses its limits: {'; '.join(fit.broken)}")
    elif fit.answer:
        lines.append(
            f"The answer is {name(fit.answer)}, {fit.luts:,} LUT4. Other scenes agree that it meets all limits."
        )
    if fit.answer and fit.answer.skin.report == "cells" and fit.task.host_us is None:
        lines.append("The host finds the contacts after the last byte; --host-us adds its time to the latency.")
    if fit.answer and (cover := fit.answer.candidate.cover) and cover.cell:
        lines.append("Light cells have an assumed spread, preload, creep and leakage (docs/levels.md).")
    if any(isinstance(source, RecordingSource) for source in fit.task.sources):
        lines.append(
            "Of a recording nobody knows what touched: its errors are against the connected pieces of its pressed "
            "cells, and its frames are no independent scenes, so intervals are too narrow."
        )
    return lines


def toml(fit: Fit, command: str) -> str:
    assert fit.answer is not None
    lines = [command, f"{fit.luts} LUT4 on {DEVICE.fpga}, {fit.answer.candidate.wires} wires"]
    for source, one in zip(fit.task.names, fit.reported, strict=True):
        errors = (f"{head} {_error(metric, one.errors[metric])}" for head, metric in zip(METRIC_HEADS, METRICS))
        worst = f", {one.speed.worst_us:.0f} us at worst" if one.speed else ""
        felt = f", fingertips not felt {_error('unfelt', one.errors['unfelt'])}" if "unfelt" in one.errors else ""
        lines.append(f"{source}, scenes not used to choose: {', '.join(errors)}{felt}{worst}")
    made = fit.answer.candidate.cover
    lit = made and made.cell and not fit.task.base.ruler  # else the circuit is that of the user's own file
    circuit = write_circuit(light.circuit_of(made)) if made and lit else ""
    cover = write_cover(made) if made else ""
    return "".join(f"# {line}\n" for line in lines) + fit.answer.skin.to_toml() + circuit + cover


def plain(fit: Fit) -> dict[str, Any]:
    """The fit for JSON; errors are shares and mm, times us."""
    shown = fit.answer or (fit.cheaper[0] if fit.cheaper else None)
    found = _trial(shown) | {"reported": _sources(fit), "luts": fit.luts} if shown else None
    return {
        "goals": dataclasses.asdict(fit.task.goals),
        "scenes": list(fit.task.names),
        "placements": fit.task.count,
        "meets": fit.answer is not None and not fit.broken,
        "broken": list(fit.broken),
        "answer": found if fit.answer else None,
        "nearest": None if fit.answer else found,
        "refused": [_trial(one) for one in fit.cheaper],
        "impossible": [{"settings": dict(one.settings), "refusal": one.refusal} for one in fit.impossible],
    }


def _trial(one: Trial) -> dict[str, Any]:
    return {
        "settings": dict(one.candidate.settings),
        "wires": one.candidate.wires,
        "bytes": one.bytes,
        "refusals": list(one.refusals),
        "chosen_on": [_measured(each) for each in one.measured],
    }


def _sources(fit: Fit) -> dict[str, Any]:
    return {name: _measured(one) for name, one in zip(fit.task.names, fit.reported, strict=True)}


def _measured(one: Measurement) -> dict[str, Any]:
    return {
        "errors": {metric: dataclasses.asdict(error) for metric, error in one.errors.items()},
        "speed": dataclasses.asdict(one.speed) if one.speed else None,
    }
