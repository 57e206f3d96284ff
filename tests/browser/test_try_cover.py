"""The cover of the page closes the switches that contactfpga.design.cover closes."""

import json

import numpy as np
from try_page import assemble, kit, load, needs_node, node

from contactfpga.design import kits
from contactfpga.design.cover import Cells, load_cover

pytestmark = needs_node

EXACT_N = 1e-12
"""Forces may differ by what sums in another order do; only a switch that close to its threshold may differ."""


def test_random_fingers_close_the_same_switches():
    rng = np.random.default_rng(4)
    skin, cover = kits.kit(assemble.KIT).skin, load_cover(kits.kit(assemble.KIT).skin_path)
    pitch_m = skin.pitch_x_mm * 1e-3
    cells = Cells(cover, skin.rows, skin.columns, pitch_m, pitch_m)
    before = np.zeros((skin.rows, skin.columns), bool)
    pairs, expected = [], []
    for _ in range(1000):
        fingers = [finger(rng, skin) for _ in range(rng.integers(0, 11))]
        pairs.append((fingers, before.astype(int).ravel().tolist()))
        loads = [load(cells, each) for each in fingers]
        forces = cells.forces_n(loads)
        expected.append((forces, before))
        before = cells.closed_by(forces, before)
    found = json.loads(node("tiles.mjs", kit(), given=json.dumps(pairs)))
    closed = 0
    for (forces, until), (page_forces, page_closed) in zip(expected, found):
        assert np.allclose(forces.ravel(), page_forces, rtol=1e-12, atol=EXACT_N)
        wanted, shape = cells.closed_by(forces, until), forces.shape
        off = wanted != np.array(page_closed, bool).reshape(shape)
        thresholds = np.where(until, cells.thresholds_n * (1 - cover.switch.hysteresis), cells.thresholds_n)
        assert np.abs(forces - thresholds)[off].max(initial=0) <= EXACT_N * 10
        closed += wanted.sum()
    assert closed > 5000


def finger(rng: np.random.Generator, skin) -> dict:
    """Anywhere that the page lets a finger be, of any size and force that it offers."""
    x, y = (rng.uniform(-0.5, count - 0.5) * skin.pitch_x_mm for count in (skin.columns, skin.rows))
    return {"x_mm": x, "y_mm": y, "radius_mm": rng.uniform(2, 15), "force_n": 10 ** rng.uniform(-1, 1)}
