"""Values of a circuit that are fitted to settle images: intervals against sheets that are drawn; what is refused."""

import math

import numpy as np
import pytest

from contactfpga.design.circuit import Circuit, CircuitError, fit
from contactfpga.design.circuit.fit import SettleReading, fit_circuit
from contactfpga_sim.model.sheet.line import ColumnLine

SIZE = 16
STATED = Circuit(line_pf=50, switch_ohm=100)
CLOCK_HZ = 60e6


def formula_s(circuit, rows, columns, diodes, pressed):
    """In place of the model: charge of the lines through the row's resistors and the switch's."""
    return 2e-12 * (circuit.line_pf + 90) * (pressed * 118 + circuit.switch_ohm + 60)


def readings(seconds, rng, scatter, clock_hz=CLOCK_HZ, shape=(SIZE, SIZE // 2)):
    """By number of pressed switches the image of a sheet whose lines scatter."""
    lines = np.outer(*(np.exp(rng.normal(0, scatter, count)) for count in shape))
    return [SettleReading(many, np.floor(each * lines * clock_hz).astype(int) + 1, 2) for many, each in seconds.items()]


@pytest.mark.parametrize(("scatter", "clock_hz"), [(0.04, 60e6), (0.08, 24e6)])
def test_all_intervals_together_cover_the_truth_as_often_as_they_say(scatter, clock_hz, monkeypatch):
    """Of 300 sheets: two standard deviations of their number below and above 95 %, and 1 % for the approximation."""
    monkeypatch.setattr(fit, "settle_s", formula_s)
    monkeypatch.setattr(fit, "DRAWS", 4000)
    covered = 0
    for seed in range(300):
        rng = np.random.default_rng(seed)
        truth = STATED.replace(line_pf=float(rng.uniform(40, 70)), switch_ohm=float(rng.uniform(80, 300)))
        seconds = {many: formula_s(truth, 0, 0, "", many) for many in (9, 17)}
        found = fit_circuit(STATED, readings(seconds, rng, scatter, clock_hz), clock_hz, 17, 17)
        covered += all(one.low <= getattr(truth, one.name) <= one.high for one in found.values)
    assert 0.915 <= covered / 300 <= 0.985


def line_s(circuit, pressed):
    """Seconds from drive to threshold of a column of an 8x8 sheet, as the virtual board computes them."""
    line = ColumnLine.of(circuit, 8, 8)
    return -line.press_s[pressed] * math.log(1 - line.threshold / line.pulled[pressed])


def test_lines_that_do_not_scatter_give_the_values_that_made_them():
    """The clock of 0.1 ns is the only error."""
    truth = Circuit(line_pf=65, switch_ohm=220, series_ohm=33)
    seconds = {many: line_s(truth, many) for many in (4, 8)}
    made = readings(seconds, np.random.default_rng(0), 0.0, 1e10, (8, 4))
    found = fit_circuit(Circuit(line_pf=50, switch_ohm=100, series_ohm=33), made, 1e10, 8, 8)
    assert found.circuit.line_pf == pytest.approx(65, rel=0.01)
    assert found.circuit.switch_ohm == pytest.approx(220, rel=0.03)
    assert (found.rows, found.columns) == (8, 4)


def test_one_image_tells_the_capacitance_alone(monkeypatch):
    monkeypatch.setattr(fit, "settle_s", formula_s)
    truth = STATED.replace(line_pf=70)
    made = readings({16: formula_s(truth, 0, 0, "", 16)}, np.random.default_rng(1), 0.02)
    (only,) = fit_circuit(STATED, made, CLOCK_HZ, SIZE, SIZE).values
    assert only.name == "line_pf"
    assert only.low <= 70 <= only.high


def test_cells_that_are_not_known_cost_the_lines_with_the_most_of_them(monkeypatch):
    monkeypatch.setattr(fit, "settle_s", formula_s)
    made = readings({many: formula_s(STATED, 0, 0, "", many) for many in (9, 17)}, np.random.default_rng(2), 0.04)
    made[0].clocks[3], made[1].clocks[5, 2] = 0, 0
    found = fit_circuit(STATED, made, CLOCK_HZ, SIZE, SIZE)
    assert (found.rows, found.columns) == (SIZE - 2, SIZE // 2)
    made[0].clocks[2:] = 0
    with pytest.raises(CircuitError, match="2 rows and 8 columns were measured as a whole"):
        fit_circuit(STATED, made, CLOCK_HZ, SIZE, SIZE)


def test_what_tells_nothing_is_refused(monkeypatch):
    monkeypatch.setattr(fit, "settle_s", formula_s)
    slow = readings({9: 30e-9, 17: 50e-9}, np.random.default_rng(3), 0.02)
    with pytest.raises(
        CircuitError, match="with 9 switches pressed in a row, cells read pressed at the first sample, 2"
    ):
        fit_circuit(STATED, slow, CLOCK_HZ, SIZE, SIZE)
    odd = readings({9: 1e-6, 17: 1.01e-6}, np.random.default_rng(3), 0.02)
    with pytest.raises(CircuitError, match="within its limits gives these times"):
        fit_circuit(STATED, odd, CLOCK_HZ, SIZE, SIZE)
    with pytest.raises(CircuitError, match="2 readings with 1 numbers of pressed switches; they must differ"):
        fit_circuit(STATED, [odd[0], odd[0]], CLOCK_HZ, SIZE, SIZE)
