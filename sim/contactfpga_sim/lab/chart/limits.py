"""The chart page's tables of the least error and of rivals."""

from __future__ import annotations

import itertools

import numpy as np

from contactfpga.skin import Skin
from contactfpga_sim.lab import pool, writer
from contactfpga_sim.lab.chart import errors
from contactfpga_sim.lab.chart.errors import Interval
from contactfpga_sim.lab.chart.floor import Floor, floor
from contactfpga_sim.lab.chart.methods import PITCH_MM, sheet
from contactfpga_sim.lab.chart.rivals import RIVALS
from contactfpga_sim.lab.covers import COVERS
from contactfpga_sim.model.scenes.families import touches

PITCHES_MM = (5.0, 6.4, 8.0, 10.0)
SCENES = 4000

CONTACTS = ("finger", "bumper")
"""Families."""

TOUCHES = 300


def floor_table() -> str:
    head = ("contact", "pitch", "felt", "barycenter", "floor, between", "table of places", "saved by the table")
    rows = list(itertools.product(CONTACTS, PITCHES_MM))
    with pool.executor() as executor:
        found = executor.map(measured, *zip(*rows, strict=True))
        return writer.table(head, [_floor_line(*row, one) for row, one in zip(rows, found, strict=True)])


def measured(family: str, pitch_mm: float, count: int = SCENES) -> Floor:
    skin = Skin(pitch_x_mm=pitch_mm, pitch_y_mm=pitch_mm)
    return floor(family, skin, COVERS["tiles"](pitch_mm), count, 0)


def _floor_line(family: str, pitch_mm: float, found: Floor) -> str:
    saved = 1 - found.table_mm.mean / found.barycenter_mm.mean
    return writer.line(
        (
            family, f"{pitch_mm:g} mm", _share(found.felt), _length(found.barycenter_mm),
            f"{found.lower_mm.mean:.2f} ({found.lower_mm.low:.2f}) and {found.upper_mm.mean:.2f}"
            f" ({found.upper_mm.high:.2f}) mm",
            _length(found.table_mm), f"{round(100 * saved)} %",
        )
    )  # fmt: skip


def rivals_table() -> writer.Table:
    head = ("model", "miscounted", "missed", "barycenter", "touch to last byte, median / 95 %", "lines", "parts")
    with pool.executor() as executor:
        rows = list(executor.map(rival_row, RIVALS))
    return writer.Table((*head, "assumes"), rows, columns=[name for name in head if name not in ("missed", "lines")])


def rival_row(name: str, count: int = TOUCHES) -> tuple[str, ...]:
    rival, cover = RIVALS[name], COVERS["tiles"](PITCH_MM)
    # On tiles of their own, cells that share a corner only are not joined.
    skin = sheet(PITCH_MM)
    scenes = touches("fingers", count, 0, skin)
    rng = np.random.default_rng(0)
    found = [rival.errors(scene, skin, cover) for scene in scenes]
    times = np.array([rival.time_us(scene, skin, cover, rng) for scene in scenes]) / 1e3
    median, late = np.quantile(times, (0.5, 0.95), method="inverted_cdf")
    means = {key: errors.interval([float(getattr(one, key)) for one in found]) for key in errors.METRICS}
    return (
        name, _share(means["miscounted"]), _share(means["missed"]), _length(means["barycenter_mm"]),
        f"{median:.1f} / {late:.1f} ms", str(rival.wires(skin)), f"{rival.cost_usd(skin):.0f} USD",
        rival.note.removeprefix("model: "),
    )  # fmt: skip


def _share(one: Interval) -> str:
    low, high = max(0.0, one.low), min(1.0, one.high)
    return f"{100 * one.mean:.1f} % ({100 * low:.1f} to {100 * high:.1f})"


def _length(one: Interval) -> str:
    return f"{one.mean:.2f} mm ({one.low:.2f} to {one.high:.2f})"
