"""A fit's result as table, text, JSON and Skin file."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Sequence
from typing import Any

from contactfpga import terminal
from contactfpga.design.cover.press import write_cover
from contactfpga.tools.console import tables
from contactfpga_sim.apps.errors import METRICS
from contactfpga_sim.apps.fit.cost import DEVICE
from contactfpga_sim.apps.fit.sources import RecordingSource
from contactfpga_sim.apps.fit.trial import Fit, Measurement, Trial
from contactfpga_sim.apps.score import Interval
from contactfpga_sim.apps.speed import Speed

HEADS = ("zones by", "scan", "cover", "sheet", "pitch mm", "baud", "LUT4", "wires", "bytes", "latency us", "verdict")
"""Column headings; equal covers and bauds are omitted."""

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


def rows(fit: Fit, impossible: bool = True) -> list[list[str]]:
    """The head, a line for the refused ones of each sheet with fewer wires and each cover on the answer's sheet,
    answer and runner-up; without an answer a line per sheet, the nearest first. ``impossible``: end with Skins that
    cannot exist."""
    lines = [_row(one, _why(one, of)) for one, of in _told(fit)]
    if fit.answer:
        lines.append(_row(fit.answer, "the answer"))
    if fit.runner_up:
        lines.append(_row(fit.runner_up, "runner-up"))
    if impossible:
        lines += [_row_of(dict(one.candidate.settings), one.refusals[0]) for one in fit.impossible]
    return _without_same([list(HEADS), *lines])


def _told(fit: Fit) -> list[tuple[Trial, int]]:
    """Refused trials for :func:`rows`, each with the number it represents; at most :data:`SHEETS` of other sheets than
    the answer's."""
    groups: dict[object, list[Trial]] = {}
    for one in fit.cheaper:
        skin, answer = one.skin, fit.answer
        key: object = (skin.rows, skin.columns)
        if answer and one.wires == answer.wires:
            key = (key, one.candidate.cover)
            if one.candidate.cover == answer.candidate.cover:
                key = one.candidate
        groups.setdefault(key, []).append(one)
    told = [(min(group, key=lambda one: (one.excess, one.margin)), len(group)) for group in groups.values()]
    if fit.answer is None:
        return told[:SHEETS]
    coarser = [each for each in told if each[0].wires < fit.answer.wires]
    return coarser[-SHEETS:] + told[len(coarser) :]


def _why(trial: Trial, of: int) -> str:
    return (f"the nearest of {of}: " if of > 1 else "") + "; ".join(trial.refusals)


def _without_same(table: list[list[str]]) -> list[list[str]]:
    for name in ("cover", "baud"):
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
    latency = _latency(speeds)
    luts = "" if trial.luts is None else f"{trial.luts:,}"
    return _row_of(dict(trial.candidate.settings), verdict, luts, str(trial.wires), _bytes(trial), latency)


def _bytes(trial: Trial) -> str:
    return "" if math.isnan(trial.bytes) else f"{trial.bytes:g}"


def _latency(speeds: Sequence[Speed]) -> str:
    if not speeds:
        return ""
    return f"{max(one.median_us for one in speeds):.0f} / {max(one.worst_us for one in speeds):.0f}"


def _row_of(settings: dict[str, Any], verdict: str, *numbers: str) -> list[str]:
    pitches = dict.fromkeys(f"{settings[name]:.4g}" for name in ("pitch_x_mm", "pitch_y_mm"))
    sheet = f"{settings['rows']}x{settings['columns']}"
    rest = numbers or ("",) * 4
    cover = settings.get("cover", "bare")
    return [
        _method(settings),
        settings["scan"],
        cover,
        sheet,
        " x ".join(pitches),
        str(settings["baud"]),
        *rest,
        verdict,
    ]


def _method(settings: dict[str, Any]) -> str:
    if settings["report"] == "cells":
        return "cells, host"
    by = settings["labeller"]
    if "connectivity" in settings:
        by += f", {settings['connectivity']}"
    return by if settings["report"] == "moments" else f"{by}, {settings['report']}"


def name(trial: Trial) -> str:
    settings = dict(trial.candidate.settings)
    pitches = dict.fromkeys((settings["pitch_x_mm"], settings["pitch_y_mm"]))
    pitch = " x ".join(f"{one:.4g}" for one in pitches)
    sheet = f"{settings['rows']}x{settings['columns']}, {pitch} mm"
    cover = f", {settings['cover']}" if "cover" in settings else ""
    return f"{_method(settings)}, {settings['scan']}, {sheet}{cover}"


def reported(fit: Fit) -> list[list[str]]:
    """The head, and a line per Skin and source on other scenes."""
    feels = any("unfelt" in one.errors for measured in fit.reported for one in measured)
    metrics = [*METRICS, "unfelt"] if feels else METRICS
    felt = [f"not felt at {fit.task.goals.felt_n:g} N"] * feels
    table = [["on scenes not used to choose", "scenes", *METRIC_HEADS, *felt, "latency us"]]
    shown = [one for one in (fit.answer, fit.runner_up) if one] or list(fit.cheaper[:1])
    words = ["the answer", "runner-up"] if fit.answer else ["the nearest"]
    for trial, word, measured in zip(shown, words, fit.reported):
        for source, one in zip(fit.task.names, measured, strict=True):
            errors = [_error(metric, one.errors[metric]) for metric in metrics]
            latency = _latency([one.speed] if one.speed else [])
            count = str(one.errors["miscounted"].count)
            table.append([f"{word}: {name(trial)}; {source}", count, *errors, latency])
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
        lines.append("On scenes not used to choose the answer meets all limits.")
    if fit.answer and fit.task.quick:
        lines.append(
            f"{fit.dearer} others were tried; which of the refused ones with as many wires are cheaper "
            "was not looked at."
        )
    elif fit.answer:
        lines.append(f"{len(fit.cheaper)} cheaper ones are refused; {fit.dearer} others cost more.")
    if any(isinstance(source, RecordingSource) for source in fit.task.sources):
        lines.append(
            "Of a recording nobody knows what touched: its errors are against the connected pieces of its pressed "
            "cells, and its frames are no independent scenes, so intervals are too narrow."
        )
    return lines


def toml(fit: Fit, command: str) -> str:
    assert fit.answer is not None
    lines = [command, f"{fit.answer.luts} LUT4 on {DEVICE.fpga}, {fit.answer.wires} wires"]
    for source, one in zip(fit.task.names, fit.reported[0], strict=True):
        errors = (f"{head} {_error(metric, one.errors[metric])}" for head, metric in zip(METRIC_HEADS, METRICS))
        worst = f", {one.speed.worst_us:.0f} us at worst" if one.speed else ""
        felt = f", fingertips not felt {_error('unfelt', one.errors['unfelt'])}" if "unfelt" in one.errors else ""
        lines.append(f"{source}, scenes not used to choose: {', '.join(errors)}{felt}{worst}")
    made = fit.answer.candidate.cover
    cover = write_cover(made) if made else ""
    return "".join(f"# {line}\n" for line in lines) + fit.answer.skin.to_toml() + cover


def plain(fit: Fit) -> dict[str, Any]:
    """The fit for JSON; errors are shares and mm, times us."""
    shown = [one for one in (fit.answer, fit.runner_up) if one] or list(fit.cheaper[:1])
    names = ("answer", "runner_up") if fit.answer else ("nearest",)
    others = {
        name: _trial(one) | {"reported": _sources(fit, measured)}
        for name, one, measured in zip(names, shown, fit.reported)
    }
    return {
        "goals": dataclasses.asdict(fit.task.goals),
        "scenes": list(fit.task.names),
        "placements": fit.task.count,
        "meets": fit.answer is not None and not fit.broken,
        "broken": list(fit.broken),
        "answer": None,
        "runner_up": None,
        **others,
        "cheaper" if fit.answer else "refused": [_trial(one) for one in fit.cheaper],
        "impossible": [
            {"settings": dict(one.candidate.settings), "refusals": list(one.refusals)} for one in fit.impossible
        ],
    }


def _trial(one: Trial) -> dict[str, Any]:
    return {
        "settings": dict(one.candidate.settings),
        "luts": one.luts,
        "wires": one.wires,
        "bytes": one.bytes,
        "refusals": list(one.refusals),
        "chosen_on": [_measured(each) for each in one.measured],
    }


def _sources(fit: Fit, measured: Sequence[Measurement]) -> dict[str, Any]:
    return {name: _measured(one) for name, one in zip(fit.task.names, measured, strict=True)}


def _measured(one: Measurement) -> dict[str, Any]:
    return {
        "errors": {metric: dataclasses.asdict(error) for metric, error in one.errors.items()},
        "speed": dataclasses.asdict(one.speed) if one.speed else None,
    }
