"""Tables of docs/failures.md."""

from __future__ import annotations

from collections.abc import Mapping

from contactfpga_sim.lab import knobs, writer
from contactfpga_sim.lab.failures.catalogue import KNOBS
from contactfpga_sim.lab.knobs import Knob, Outcome, Sweep

HEAD = (
    *("knob", "method", "holds until", "breaks at", "closed form"),
    *("what breaks", "reported", "what helps"),
)


SHOWN = ("crossing", "closing", "light", "bounce", "diodes", "broken", "stuck", "silence")
"""Knobs whose first method the page shows."""
COLUMNS = ("knob", "breaks at", "what helps")


def table(sweeps: Mapping[str, Mapping[str, Sweep]]) -> writer.Table:
    lines = {name: rows(KNOBS[name], methods) for name, methods in sweeps.items()}
    shown = [lines[name][0] for name in SHOWN]
    return writer.Table(HEAD, [row for some in lines.values() for row in some], lambda row: row in shown, COLUMNS)


def rows(knob: Knob, methods: Mapping[str, Sweep]) -> list[tuple[str, ...]]:
    """A knob's rows, common cells in the first."""
    lines = []
    for number, (method, sweep) in enumerate(methods.items()):
        first = f"{knob.title}: {knob.axis}" if number == 0 else ""
        helps = knob.helps if number == 0 else ""
        closed = knob.format.format(knob.closed[method]) if method in knob.closed else ""
        holds, breaks, *rest = _cells(knob, sweep)
        lines.append((first, method, holds, breaks, closed, *rest, helps))
    return lines


def _cells(knob: Knob, sweep: Sweep) -> list[str]:
    last = len(sweep.values) - 1 if sweep.broken is None else sweep.broken - 1
    holds = "fails at the first value"
    if last >= 0:
        holds = knob.format.format(sweep.values[last]) + _rate(sweep.outcomes[last])
    if sweep.broken is None:
        return [f"{holds}, end of range", "", "no failure", ""]
    first = sweep.outcomes[sweep.broken]
    at = knob.format.format(sweep.breaks_at)
    return [holds, f"**{at}**{_rate(first)}", first.what, says(knob, sweep)]


def _rate(outcome: Outcome) -> str:
    return f": {outcome.rate}" if outcome.rate else ""


def says(knob: Knob, sweep: Sweep) -> str:
    """Reports at the break and before, and whether anything later is unnoticed."""
    assert sweep.broken is not None
    told = sweep.outcomes[sweep.broken].told
    parts = [", ".join(f"`{word}`" for word in told) if told else "**not noticed**"]
    if sweep.warns_at is not None:
        words = ", ".join(f"`{word}`" for word in sweep.outcomes[sweep.values.index(sweep.warns_at)].told)
        since = f"from {knob.format.format(sweep.warns_at)} on"
        parts = [f"{parts[0]}, {since}"] if words == parts[0] else [*parts, f"{words} {since}"]
    if told and sweep.silent_at is not None:
        parts.append(f"**not noticed** at {knob.format.format(sweep.silent_at)}")
    if not told and (later := [value for value, one in zip(sweep.values, sweep.outcomes) if one.verdict == "told"]):
        first = sweep.outcomes[sweep.values.index(later[0])].told
        parts.append(f"{', '.join(f'`{word}`' for word in first)} from {knob.format.format(later[0])} on")
    return "; ".join(parts)


UNNOTICED = ("knob", "where", "why nothing reports it")


EXPLAINED = SHOWN[-4:]
"""Knobs whose reason the page shows."""


def unnoticed(sweeps: Mapping[str, Mapping[str, Sweep]]) -> writer.Table:
    """A row per knob with an unnoticed fault, and the reason."""
    lines = []
    for name, methods in sweeps.items():
        where = [method for method, found in methods.items() if found.silent_at is not None]
        if where:
            knob = KNOBS[name]
            lines.append((knob.title, ", ".join(where), knob.unnoticed))
    titles = [KNOBS[name].title for name in EXPLAINED]
    return writer.Table(UNNOTICED, lines, lambda row: row[0] in titles, (UNNOTICED[0], UNNOTICED[2]))


def compute() -> dict[str, dict[str, Sweep]]:
    return knobs.sweeps("contactfpga_sim.lab.failures.catalogue")
