"""What a fit found, as a table, as text, as JSON and as the Skin's file."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence
from typing import Any

from contactfpga import terminal
from contactfpga.design.cover.press import write_cover
from contactfpga.tools.console import tables
from contactfpga_sim.lab.chart.errors import METRICS, Interval
from contactfpga_sim.lab.fit.cost import DEVICE
from contactfpga_sim.lab.fit.sources import Recorded
from contactfpga_sim.lab.fit.trial import Fit, Measurement, Trial

HEADS = ("zones by", "scan", "sheet", "pitch mm", "baud", "LUT4", "wires", "bytes", "latency us", "verdict")
"""Baud is left out where all have the same."""

METRIC_HEADS = ("scenes miscounted", "contacts missed", "barycenter", "area")


def printed(found: Fit) -> None:
    """Print tables and notes for people."""
    _print(rows(found), bold="the answer")
    _print(reported(found), keys=1)
    for line in notes(found):
        terminal.say(line)


def printed_so_far(trials: Iterable[Trial]) -> None:
    """Print what is known when the search was interrupted."""
    _print(rows_so_far(trials))


def _print(lines: Sequence[Sequence[str]], keys: int = 4, bold: str | None = None) -> None:
    """Of the Skins what tells them apart comes first, and the verdict last."""
    styles = {number: "bold" for number, line in enumerate(lines[1:]) if line[-1] == bold}
    tables.show(lines, keys=keys, texts=[len(lines[0]) - 1] if keys > 1 else [], styles=styles)


def rows(fit: Fit, impossible: bool = True) -> list[list[str]]:
    """The head, and a line for each Skin that is cheaper than the answer, the answer and the runner-up; without an
    answer for each Skin, the nearest one first. ``impossible``: at the end those for which there is no Skin."""
    lines = [_row(one, "; ".join(one.refusals)) for one in fit.cheaper]
    if fit.answer:
        lines.append(_row(fit.answer, "the answer"))
    if fit.runner_up:
        lines.append(_row(fit.runner_up, "runner-up"))
    if impossible:
        lines += [_row_of(dict(one.candidate.settings), one.refusals[0]) for one in fit.impossible]
    table = [list(HEADS), *lines]
    place = HEADS.index("baud")
    if len({line[place] for line in lines}) == 1:
        table = [line[:place] + line[place + 1 :] for line in table]
    return table


def rows_so_far(trials: Iterable[Trial]) -> list[list[str]]:
    """The head, and a line for each Skin that was measured when the search was ended, the nearest one first."""
    nearest = sorted(trials, key=lambda one: (one.excess, one.cost))
    return [list(HEADS), *(_row(one, "; ".join(one.refusals) or "meets the limits") for one in nearest)]


def plain_so_far(trials: Iterable[Trial]) -> dict[str, Any]:
    """The same for JSON."""
    return {"interrupted": True, "measured": [_trial(one) for one in sorted(trials, key=lambda one: one.excess)]}


def _row(trial: Trial, verdict: str) -> list[str]:
    speeds = [one.speed for one in trial.measured]
    latency = f"{max(one.median_us for one in speeds):.0f} / {max(one.worst_us for one in speeds):.0f}"
    luts = "" if trial.luts is None else f"{trial.luts:,}"
    return _row_of(dict(trial.candidate.settings), verdict, luts, str(trial.wires), f"{trial.bytes:g}", latency)


def _row_of(settings: dict[str, Any], verdict: str, *numbers: str) -> list[str]:
    pitches = dict.fromkeys(f"{settings[name]:.4g}" for name in ("pitch_x_mm", "pitch_y_mm"))
    sheet = f"{settings['rows']}x{settings['columns']}"
    rest = numbers or ("",) * 4
    return [_method(settings), settings["scan"], sheet, " x ".join(pitches), str(settings["baud"]), *rest, verdict]


def _method(settings: dict[str, Any]) -> str:
    if settings["report"] == "cells":
        return "cells, host"
    by = settings["labeller"]
    if "connectivity" in settings:
        by += f", {settings['connectivity']}"
    return by if settings["report"] == "moments" else f"{by}, {settings['report']}"


def name(trial: Trial) -> str:
    """A Skin in a few words."""
    settings = dict(trial.candidate.settings)
    pitches = dict.fromkeys((settings["pitch_x_mm"], settings["pitch_y_mm"]))
    pitch = " x ".join(f"{one:.4g}" for one in pitches)
    return f"{_method(settings)}, {settings['scan']}, {settings['rows']}x{settings['columns']}, {pitch} mm"


def reported(fit: Fit) -> list[list[str]]:
    """The head, and a line for each Skin and source of what was measured on the other scenes."""
    table = [["on scenes not used to choose", "scenes", *METRIC_HEADS, "latency us"]]
    shown = [one for one in (fit.answer, fit.runner_up) if one] or list(fit.cheaper[:1])
    words = ["the answer", "runner-up"] if fit.answer else ["the nearest"]
    for trial, word, measured in zip(shown, words, fit.reported):
        for source, one in zip(fit.task.names, measured, strict=True):
            errors = [_error(metric, one.errors[metric]) for metric in METRICS]
            latency = f"{one.speed.median_us:.0f} / {one.speed.worst_us:.0f}"
            count = str(one.errors["miscounted"].count)
            table.append([f"{word}: {name(trial)}; {source}", count, *errors, latency])
    return table


def _error(metric: str, error: Interval) -> str:
    scale, unit = (1, " mm") if metric == "barycenter_mm" else (100, " %")
    low, high = (f"{max(0.0, scale * end):.2f}" for end in (error.low, error.high))
    return f"{scale * error.mean:.2f}{unit} ({low} to {high})"


def notes(fit: Fit) -> list[str]:
    """What has to be said of the answer, or of there being none."""
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
        lines.append(f"{fit.dearer} others were tried; which of the refused ones are cheaper was not looked at.")
    elif fit.answer:
        lines.append(f"{len(fit.cheaper)} cheaper ones are refused; {fit.dearer} others cost more.")
    if any(isinstance(source, Recorded) for source in fit.task.sources):
        lines.append(
            "Of a recording nobody knows what touched: its errors are against the connected pieces of its pressed "
            "cells, and its frames are no independent scenes, so intervals are too narrow."
        )
    return lines


def toml(fit: Fit, command: str) -> str:
    """The answer's file, with what was measured on top."""
    assert fit.answer is not None
    lines = [command, f"{fit.answer.luts} LUT4 on {DEVICE.fpga}, {fit.answer.wires} wires"]
    for source, one in zip(fit.task.names, fit.reported[0], strict=True):
        errors = (f"{head} {_error(metric, one.errors[metric])}" for head, metric in zip(METRIC_HEADS, METRICS))
        lines.append(f"{source}, scenes not used to choose: {', '.join(errors)}, {one.speed.worst_us:.0f} us at worst")
    cover = write_cover(fit.task.cover) if fit.task.cover else ""
    return "".join(f"# {line}\n" for line in lines) + fit.answer.skin.to_toml() + cover


def plain(fit: Fit) -> dict[str, Any]:
    """For JSON; errors are shares and mm, times us."""
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
        "speed": dataclasses.asdict(one.speed),
    }
