"""Fall times through resistive cells against ngspice on extracted lines, and what a Skin's file states.

What only this kills: a cell's time off by more than 5 % (0.07 octaves) over temperature, leakage and neighbors, a ruler
that does not track, and a level that a pull or hot diodes hold up.
"""

import numpy as np
import pytest

from contactfpga.design import kits
from contactfpga.design.circuit import SCHOTTKY, SILICON, Circuit, CircuitError, falling, load_checked, phases
from contactfpga.design.circuit.falling import Corner
from contactfpga.design.circuit.network import Network
from contactfpga.design.circuit.phases import Levels
from contactfpga.design.circuit.values import Falling
from contactfpga.design.cover import load_cover
from contactfpga.design.sheet import extract
from contactfpga.design.sheet.layout import lay_out
from contactfpga.skin import Skin
from contactfpga_sim.model.sheet import agreement

SIZE, ROW = 8, 4
LEVELS_N = 0.13, 0.53, 1.74
"""Levels of the soft kit (docs/soft.md)."""
STATED = Circuit(falling=Falling(), column_pull_ohm=1e8, diode=SILICON, series_ohm=33.0)


def extracted() -> Circuit:
    """Lines of an 8x8 sheet as its layout has them."""
    return extract.extracted(lay_out(Skin(rows=SIZE, columns=SIZE), STATED)).circuit


@pytest.mark.slow
@pytest.mark.skipif(not agreement.installed(), reason="ngspice is not installed")
@pytest.mark.parametrize(("celsius", "supply_v"), [(-20.0, 3.0), (27.0, 3.3), (70.0, 3.6)])
@pytest.mark.parametrize("level", range(3))
def test_the_soft_kit_reads_its_levels_at_the_corners_in_ngspice(level, celsius, supply_v):
    """On its own lines, the ruler's multiple lies between the times of cells 0.3 octaves from the level's resistance,
    pressed harder alone or in a whole row, and lighter alone, at a threshold that follows the
    supply."""
    kit, cell = kits.kit("soft"), load_cover(kits.kit("soft").skin_path).cell
    level_ohm = float(cell.ohm(np.array(LEVELS_N[level])))
    circuit = extract.extracted(kit.layout).circuit.replace(supply_v=supply_v)
    lines, at_v = (kit.skin.row_lines, kit.skin.columns), circuit.falling.threshold_v * supply_v / 3.3
    fallen_s = []
    for together, ohm in (
        (True, circuit.falling.ruler_ohm),
        (False, level_ohm / 2**0.3),
        (True, level_ohm / 2**0.3),
        (False, level_ohm * 2**0.3),
    ):
        cells, row = np.full(lines, np.inf), lines[0] // 2
        cells[row] = ohm if together else np.inf  # the ruler's columns fall together
        cells[row, 3] = ohm
        phase = phases.settle(Network(circuit, np.isfinite(cells), ohm=cells), Levels.of(circuit))
        seconds, volts = agreement.run(phase, 60e-6, 6000, celsius)
        fallen_s.append(float(np.interp(-at_v, -volts[:, 3], seconds)))
    ruler_s, *harder_s, lighter_s = fallen_s
    assert max(harder_s) < ruler_s * kit.skin.derived.rulers[level] / falling.SIXTEENTHS < lighter_s


PATTERNS = {
    "one cell": ({}, 0.005),
    "a row": ({"together": SIZE}, 0.005),
    "a sheet": ({"together": SIZE, "others": SIZE - 1}, 0.005),
    "neighbors": ({"beside": 2}, 0.035),  # which are still falling
}


@pytest.mark.skipif(not agreement.installed(), reason="ngspice is not installed")
@pytest.mark.parametrize("ohm", [5_000.0, 44_000.0, 150_000.0])
@pytest.mark.parametrize("name", PATTERNS)
@pytest.mark.parametrize(("celsius", "leak_a"), [(27.0, 0.0), (-20.0, 1e-6), (70.0, -1e-6), (70.0, 1e-6)])
def test_a_column_falls_as_in_ngspice(name, ohm, celsius, leak_a):
    """From selecting the middle row until the column is at the pin's threshold."""
    (pattern, within), circuit, cells = PATTERNS[name], extracted(), np.full((SIZE, SIZE), np.inf)
    if name == "neighbors":  # as close as wires in a ribbon
        circuit, cells[ROW, [2, 4]] = circuit.replace(neighbor_pf=12.0), ohm / 50
    cells[ROW, 3] = ohm
    cells[ROW if name == "a row" else slice(0, SIZE if name == "a sheet" else 0)] = ohm
    ours = float(falling.fall_s(circuit, ohm, SIZE, Corner(celsius=celsius, leak_a=leak_a, **pattern))[0])
    phase = phases.settle(Network(circuit, np.isfinite(cells), ohm=cells), Levels.of(circuit))
    seconds, volts = agreement.run(phase, 1.3 * ours, 4000, celsius, leak_a)
    assert np.interp(-circuit.falling.threshold_v, -volts[:, 3], seconds) == pytest.approx(ours, rel=within)


def test_a_light_level_holds_by_the_ruler_alone_and_with_silicon_diodes_alone():
    """Worst corner of -20 to 70 degrees Celsius, thresholds from 1.1 to 1.7 V, capacitors of 5 %."""
    circuit = extracted()
    assert falling.error_octaves(circuit, 17, 17, 44_000, leak_ua=1.0) < 0.3
    assert falling.error_octaves(circuit, 17, 17, 44_000, leak_ua=1.0, ruled=False) > 0.7
    assert falling.error_octaves(circuit, 17, 17, 44_000, leak_ua=10.0) > 1.0
    assert falling.error_octaves(circuit.replace(diode=SCHOTTKY), 17, 17, 44_000, leak_ua=1.0) > 1.0
    assert falling.read_ohm(circuit, 17, float(falling.fall_s(circuit, 9e4, 17)[0])) == pytest.approx(9e4, rel=0.01)


FILE = """guard = true
precharge_us = 0.5
ruler = 28
settle_us = 40
[circuit]
diode = "silicon"
column_pull_ohm = 1e8
falling.column_pf = 220
"""


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("1e8", "47_000", "columns do not fall through the ruler: column_pull_ohm = 47000, or hot diodes"),
        ("us = 40", "us = 10", "settle_us is 10; with ruler = 28 the latest sample comes after"),
        ("28", "0", "ruler is 0; [circuit.falling] needs a Skin with a ruler"),
        ("falling.column_pf", "line_pf", "there is no [circuit.falling]"),
        ("column_pf = 220", "leak_ua = -1", "leak_ua in [circuit.falling] is -1; it must lie between"),
        ("column_pf", "pf", "unknown key 'pf' in [circuit.falling]"),
    ],
)
def test_a_file_whose_columns_cannot_fall_is_refused(tmp_path, old, new, message):
    path = tmp_path / "skin.toml"
    path.write_text(FILE)
    assert load_checked(path, Skin.load(path)).falling == Falling()
    path.write_text(FILE.replace(old, new))
    with pytest.raises(CircuitError) as caught:
        load_checked(path, Skin.load(path))
    assert message in str(caught.value)
