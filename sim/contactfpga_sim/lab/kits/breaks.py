"""From which value of a disturbance the soft kit's levels are off or its counts wrong; a table of docs/soft.md.

One disturbance at a time: circuit and temperature are usual otherwise, and film and preload are drawn as the kit states
them. Levels are those of the model of the falling columns, without the whole clocks of the gateware.
"""

from __future__ import annotations

import bisect
import dataclasses
import functools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from contactfpga.design import kits
from contactfpga.design.circuit import falling
from contactfpga.design.circuit.falling import Corner
from contactfpga.design.cover import Cover, ResistiveCell, load_cover
from contactfpga.design.cover.cell import read_cell
from contactfpga.design.cover.cells import cells_of
from contactfpga.design.sheet.extract import extracted
from contactfpga.zones.levels import LASTS, label
from contactfpga_sim.apps import pool
from contactfpga_sim.apps.light import GUARD
from contactfpga_sim.lab import writer
from contactfpga_sim.lab.cell.tables import WITHIN
from contactfpga_sim.lab.knobs import Outcome, RateTest
from contactfpga_sim.model.scenes.families import placements

KIT, SEED = kits.kit("soft"), 5
MOST, VALUES = 480, 61
"""Touches by which a value is decided, and values tried."""
RESTED_S = 3600.0
"""Age of the preload when the cells that it presses are measured: chosen."""
SKIN, CIRCUIT, COVER = KIT.skin, extracted(KIT.layout).circuit, load_cover(KIT.skin_path) or Cover()
CELL, LINES = COVER.cell or read_cell({"material": "velostat"}), (SKIN.row_lines, SKIN.columns)


class Film(NamedTuple):
    """A sheet under a disturbance."""

    cell: ResistiveCell = CELL
    celsius: float = 25.0
    seconds: float = 1.0
    """Time for which a touch has lasted."""
    ends: tuple[Corner, ...] = (Corner(),)
    """Conditions of columns. Each cell has one of them, and the ruler that in which it is slowest."""
    lasting: bool = False
    """Whether columns were so at rest, too, when cells were masked."""

    @functools.cache  # noqa: B019 - of few films
    def read_ohm(self) -> np.ndarray:
        """(levels, ends) the largest resistances that read pressed."""
        one_s = max(falling.ruler_s(CIRCUIT, *LINES, end) for end in self.ends) / falling.SIXTEENTHS
        instants_s = one_s * np.array(SKIN.derived.rulers)
        return np.array([falling.read_ohm(CIRCUIT, LINES[0], instants_s, end) for end in self.ends]).T

    def octaves(self) -> float:
        """Largest difference of the force of a level from the usual one, of a cell without spread and preload."""
        with np.errstate(divide="ignore"):
            film = CELL.ohm_at_1n / self.cell.ohm(np.array(1.0), self.celsius, self.seconds)
            off = np.log2(self.read_ohm() / Film().read_ohm() * film)
        return float(np.abs(off).max()) / self.cell.exponent

    def levels(self, forces_n: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """(rows, columns) levels of a drawn sheet, without the cells that its preload pressed at rest: these are
        masked."""
        gains, preload_n = self.cell.drawn(forces_n.shape, int(rng.integers(2**31)))
        of = rng.integers(len(self.ends), size=forces_n.shape)
        held_s = self.seconds + np.where(forces_n > 0, 0.0, RESTED_S)
        ohm = gains * self.cell.ohm(np.maximum(forces_n, 0) + preload_n, self.celsius, held_s)
        rest_ohm, lightest = gains * self.cell.ohm(preload_n, seconds=RESTED_S), self.read_ohm()[0, of]
        pressed = rest_ohm * GUARD <= (lightest if self.lasting else CELL.level_ohm)
        return np.where(pressed, 0, (ohm <= self.read_ohm()[:, of]).sum(axis=0))


def _cell(**values: Any) -> Film:
    return Film(dataclasses.replace(CELL, **values))


def _ends(lasting: bool = False, **values: Any) -> Film:
    return Film(
        lasting=lasting,
        ends=tuple(Corner(**{name: sign * value for name, value in values.items()}) for sign in (-1, 1)),
    )


class Disturbance(NamedTuple):
    form: str
    """Format of a value with its unit."""
    expected: float
    tried: tuple[float, float]
    """Least and largest value tried."""
    film: Callable[[float], Film]
    told: str = "nothing"
    """What reports it."""
    octaves: Callable[[float], float] | None = None
    """How far a level is off, where cells differ by chance: of two standard deviations. None: :meth:`Film.octaves`."""

    def off(self, value: float) -> float:
        return self.octaves(value) if self.octaves else self.film(value).octaves()

    def touches(self, value: float, rng: np.random.Generator, count: int) -> list[Outcome]:
        return [_touch(self.film(value), rng) for _ in range(count)]

    def first(self, wrong: Callable[[float], bool]) -> float | None:
        """The least value tried that is wrong, if larger ones are."""
        values = np.geomspace(*self.tried, VALUES).tolist()
        place = bisect.bisect_left(values, True, key=wrong)
        return values[place] if place < VALUES else None


FACTOR, REST = "bring-up, in each cell's factor", "`contactfpga wire --rest`"
DISTURBANCES = {
    "spread from cell to cell": Disturbance(
        "{:.0f} %", 30.0, (5.0, 100.0), lambda percent: _cell(spread=percent / 100), FACTOR,
        lambda percent: 2 * percent / 100 / math.log(2)),
    "preload of the cover, rms": Disturbance(
        "{:.2g} N", 0.02, (0.005, 0.2), lambda newtons: _cell(preload_n=newtons), REST,
        lambda newtons: -math.log2(max(1 - 2 * newtons / CELL.level_n, 1e-9))),
    "creep in a touch that lasts": Disturbance(
        "{:,.0f} min", 1440.0, (0.1, 1e5), lambda minutes: Film(seconds=60 * minutes), REST),
    "temperature": Disturbance(
        "{:.0f} °C", 50.0, (26.0, 85.0), lambda celsius: Film(celsius=celsius, ends=(Corner(celsius=celsius),))),
    "capacitors, off by": Disturbance(
        "{:.0f} %", 2.0, (0.5, 90.0), lambda percent: _ends(True, tolerance=percent / 100), FACTOR),
    "leakage of the pins": Disturbance("{:.2g} µA", 10.0, (0.1, 30.0), lambda leak: _ends(leak_a=1e-6 * leak)),
    "edges of a motor's drive": Disturbance(
        "{:.0f} mV", 100.0, (10.0, 1200.0), lambda mv: _ends(threshold_v=1e-3 * mv)),
}  # fmt: skip


@functools.lru_cache(maxsize=MOST)
def _forces_n(number: int) -> np.ndarray:
    (scene,) = placements("finger", 1, SEED, SKIN, number)
    cells = cells_of(COVER, SKIN.rows, SKIN.columns, *(1e-3 * one for one in (SKIN.pitch_x_mm, SKIN.pitch_y_mm)))
    return cells.forces_n(scene.on_cover(SKIN, COVER).loads(0.0))


def _touch(film: Film, rng: np.random.Generator) -> Outcome:
    """Whether a touch by a finger is one contact."""
    read = film.levels(_forces_n(int(rng.integers(2**31))), rng)
    return Outcome(int(label(read, SKIN.connectivity, LASTS).max()) == 1)


def _row(name: str) -> list[str]:
    one, form = DISTURBANCES[name], DISTURBANCES[name].form.format
    counted = RateTest(one.touches, SEED, MOST)
    off, lost = one.first(lambda value: one.off(value) > WITHIN), one.first(lambda value: not counted(value).right)
    limits = (form(value) if value is not None else f"above {form(one.tried[1])}" for value in (off, lost))
    there, right = f"{one.off(one.expected):.2f}", counted(one.expected).rate
    return [name, form(one.expected), there, next(limits), right, next(limits), one.told]


def breaks_table() -> str:
    """Each disturbance at the value to expect, and from which value it is too large."""
    head = ["disturbance", "to expect", "octaves off", f"above {WITHIN} from", "touches right", "below 95 % from"]
    with pool.executor() as workers:
        return writer.table_of([[*head, "what reports it"], *workers.map(_row, DISTURBANCES)])
