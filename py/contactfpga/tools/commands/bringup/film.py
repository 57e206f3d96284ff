"""The bring-up's step for resistive cells: the film's law and each cell's factor, by known weights.

A cell's least sample that reads pressed is a fall time, hence a resistance by the model of the columns.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from contactfpga.design.circuit import falling
from contactfpga.design.cover.fitted import ODD, fit_film
from contactfpga.driver.health import Finding
from contactfpga.instruments.rest import NEVER
from contactfpga.instruments.watch import named
from contactfpga.tools.commands.bringup.bench import Bench, Step
from contactfpga.tools.commands.wire import rest

CELL_N = 0.15, 0.45
"""Forces on each cell, from light to heavy."""
KG_N = 9.81


def film(bench: Bench) -> Step:
    """Resistances under two weights on the whole sheet."""
    skin, cover = bench.skin, bench.cover
    assert cover is not None
    assert cover.cell is not None
    assert bench.stated is not None
    # the board beside the cells carries the rest of an even weight
    wide_mm, high_mm = (1e3 * cover.width_m(1e-3 * pitch) for pitch in (skin.pitch_x_mm, skin.pitch_y_mm))
    cells, ohm = skin.rows * skin.columns * skin.pitch_x_mm * skin.pitch_y_mm / (wide_mm * high_mm), []
    for force in CELL_N:
        whole = f"Lay a flat plate as large as all cells on the foam, with {force * cells / KG_N:.1f} kg in all, evenly"
        bench.person.asked(f"weight {force:g}", f"{whole}, and wait ten seconds.")
        levels = rest.levels(bench.board, bench.timeout).levels
        instants = (levels - 0.5) / falling.SIXTEENTHS * falling.ruler_s(bench.stated, skin.row_lines, skin.columns)
        pressed = falling.Corner(together=skin.columns, others=skin.rows - 1)
        read = falling.read_ohm(bench.stated, skin.row_lines, instants, pressed)
        ohm.append(np.where(levels < NEVER, np.maximum(read, falling.GRID_OHM[0]), np.nan))
    if np.isfinite(ohm[0]).mean() < 0.5:
        few = "most cells read released under the lighter weight; does it lie evenly on the foam?"
        return Step("film", (Finding("fault", few),))
    bench.film = fit_film(np.array(ohm), CELL_N)
    found = [*_odd(bench.film.factors)]
    for name, value, low, high in bench.film.values:
        given = getattr(cover.cell, name)
        inside = "as stated" if low <= given <= high else f"not the {given:g} that the kit states"
        found.append(Finding("ok", f"{name} = {value:.4g} ({low:.4g} to {high:.4g}), {inside}"))
    measured = {f"film_{name}": value for name, value, _, _ in bench.film.values}
    return Step("film", tuple(found), measured)


def _odd(factors: np.ndarray) -> Iterator[Finding]:
    for cells, what in (
        (np.isnan(factors), "never reads pressed under the weights: no film, an open comb, or its diode"),
        (factors <= 1 / ODD, "is far too sensitive: a short circuit between its combs, dirt, or a crease in the film"),
        (factors >= ODD, "hardly feels the weights: the film does not lie on its combs"),
    ):
        for row, column in np.argwhere(cells).tolist():
            yield Finding("fault", f"{named([(row, column)])} {what}")
