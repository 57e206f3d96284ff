"""Tables of docs/levels.md and docs/benchmark.md, and the picture of the benchmark's entries."""

from __future__ import annotations

from pathlib import Path

from contactfpga_sim.apps import score
from contactfpga_sim.apps.score import MODELS, Interval
from contactfpga_sim.lab import writer
from contactfpga_sim.lab.benchmark.scenes import FAMILIES
from contactfpga_sim.lab.chart import front_picture
from contactfpga_sim.lab.levels.compute import Found, Judged
from contactfpga_sim.lab.levels.compute import compute as study

SHOWN = ("1", "3")
"""Numbers of levels that the page shows: those of a map with one and with two bits a cell."""


SCORES = Path("docs/chart/benchmark.csv")


def compute() -> Found:
    found = study()
    score.write(SCORES, [*found.entries, *found.bounds])
    return found


def draw(folder: Path) -> Path:
    return front_picture.save(SCORES, folder / "front.svg")


def entries_table(found: Found) -> writer.Table:
    """The benchmark's entries: wrong counts in the worst family by each model, places and times of all."""
    head = [
        "entry",
        *(f"worst family, {model}" for model in MODELS),
        "place, elements",
        "touch to last byte, median / 95 %",
    ]
    rows = []
    for entry, scores in found.entries:
        families = [score.worst(scores, model) for model in MODELS]
        shares = [f"{family} {_share(scores[family, model].wrong)}" for family, model in zip(families, MODELS)]
        every = scores["all", MODELS[-1]]
        late = f"{1e3 * every.median_s.mean:.1f} / {1e3 * every.late_s.mean:.1f} ms"
        named = f"{entry.name} (model)" if entry.kind == "model" else entry.name
        rows.append([named, *shares, f"{every.place_mm.mean:.2f} mm", late.replace("inf", "never")])
    shown = (*front_picture.KITS, "three levels, 5 mm", "three levels, 6.4 mm", "one level, 5 mm")
    return writer.Table(
        head,
        rows,
        lambda row: row[0] in shown or "(model)" in row[0],
        before=f"{scores[families[0], MODELS[0]].wrong.count} scenes per family:",
    )


def levels_table(found: Found) -> writer.Table:
    """Wrong counts of each design, the worst family first."""
    head = ["pitch", "levels", "forces", "wires", "map", "row", *(f"worst family, {model}" for model in MODELS)]
    more = [f"{family}, {model}" for model in MODELS for family in FAMILIES]
    strict = [f"{family} apart, {model}" for model in MODELS for family in FAMILIES]
    rows = [
        [
            *_design(one),
            *(f"{family} {_share(share)}" for family, share in map(one.worst, MODELS)),
            str(one.reading.lasts),
            *(_share(one.scores[family, model].wrong) for model in MODELS for family in FAMILIES),
            *(_share(one.scores[family, model].apart) for model in MODELS for family in FAMILIES),
        ]
        for one in found.designs
    ]
    return writer.Table([*head, "parts last", *more, *strict], rows, lambda row: row[1] in SHOWN, head)


def places_table(found: Found) -> writer.Table:
    """Errors of place of the scenes with a right count."""
    head = ["pitch", "levels", *(f"{family}, elements" for family in FAMILIES)]
    rows = [
        [
            *_design(one)[:2],
            *(f"{one.scores[family, model].place_mm.mean:.2f} mm" for model in MODELS[::-1] for family in FAMILIES),
        ]
        for one in found.designs
    ]
    return writer.Table([*head, *(f"{family}, model" for family in FAMILIES)], rows, lambda row: row[1] in SHOWN, head)


def verdict_table(found: Found) -> str:
    """Three levels beside one level that costs no more."""
    head = ["three levels", "one level", "cost of the one", *(f"worst family, {model}" for model in MODELS), "better"]
    return writer.table_of([head, *(_verdict(three, one) for three, one in rivals(found.designs))])


def rivals(found: list[Judged]) -> list[tuple[Judged, Judged]]:
    """Three levels at each pitch, with one level at the same pitch, and with one level at the finest pitch whose map
    has no more bytes, if that is another."""
    of = {(one.pitch_mm, len(one.reading.forces_n)): one for one in found}
    pairs = []
    for pitch in dict.fromkeys(one.pitch_mm for one in found):
        three, same = of[pitch, 3], of[pitch, 1]
        cheaper = [one for (_, count), one in of.items() if count == 1 and one.map_bytes <= three.map_bytes]
        finest = min(cheaper, key=lambda one: one.pitch_mm)
        pairs += [(three, same)] + [(three, finest)] * (finest != same)
    return pairs


def _verdict(three: Judged, one: Judged) -> list[str]:
    cost = f"{one.wires} wires for {three.wires}, {one.map_bytes} bytes for {three.map_bytes}"
    shares = [f"{_share(three.worst(model)[1])} for {_share(one.worst(model)[1])}" for model in MODELS]
    return [f"{three.pitch_mm:g} mm", f"{one.pitch_mm:g} mm", cost, *shares, "yes" if three.beats(one) else "no"]


def _design(one: Judged) -> list[str]:
    forces = ", ".join(f"{force:g}" for force in one.reading.forces_n)
    head = [f"{one.pitch_mm:g} mm", str(len(one.reading.forces_n)), f"{forces} N"]
    return [*head, str(one.wires), f"{one.map_bytes} bytes", f"{one.row_time:.2g}"]


def _share(share: Interval) -> str:
    return f"{100 * share.mean:.1f} % ({100 * share.low:.1f} to {100 * share.high:.1f})"
