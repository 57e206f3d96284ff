"""The circuit model against ngspice, where it is installed."""

import dataclasses
import math

import pytest

from contactfpga.design.circuit import SCHOTTKY, SILICON, Circuit, patterns, phases
from contactfpga.design.circuit.network import Network
from contactfpga.design.circuit.phases import Levels
from contactfpga_sim.model.sheet import agreement

pytestmark = pytest.mark.skipif(not agreement.installed(), reason="ngspice is not installed")

WITHIN = 0.05
"""Of a time."""
CASES = list(agreement.cases())


def check(case):
    found = agreement.compared(case)
    assert found.ours_s > 0
    assert abs(found.error) < WITHIN
    if math.isfinite(found.ours_v):
        assert found.ours_v == pytest.approx(found.spice_v, abs=0.01)


@pytest.mark.parametrize("name", agreement.PHASES)
@pytest.mark.parametrize("diode", ["schottky", "silicon"])
def test_a_small_sheet_in_each_phase(name, diode):
    circuit = Circuit() if diode == "schottky" else Circuit(diode=SILICON, switch_ohm=800.0, column_pull_ohm=30_000.0)
    make, names = agreement.PHASES[name]
    phase = make(Network(circuit, patterns.named(8, 8)[names[-1]]), Levels.of(circuit))
    check(agreement.SpiceCase(circuit, names[-1], phase))


def test_a_model_without_the_diodes_charge_is_told_apart():
    """What the comparison is for: a wrong model is outside the 5 %."""
    plain = Circuit()
    bald = Circuit(diode=dataclasses.replace(SCHOTTKY, junction_pf=0.0))
    phase = phases.settle(Network(plain, patterns.named(8, 8)["all"]), Levels.of(plain))
    wrong = phases.settle(Network(bald, patterns.named(8, 8)["all"]), Levels.of(bald))
    seconds, volts = agreement.run(phase, 1e-6)
    assert abs(phases.passed(wrong).seconds / phase.arrived(seconds, volts).max() - 1) > WITHIN


def test_a_bare_switch_conducts_both_ways():
    pressed = patterns.named(4, 4)["one column"]
    bare = patterns.named(4, 4)["one column but a cell"]
    circuit = Circuit(column_pull_ohm=10_000.0)
    phase = phases.settle(Network(circuit, pressed, bare), Levels.of(circuit))
    _, volts = agreement.run(phase, 20e-6)
    assert volts[-1] == pytest.approx(phases.rest_volts(phase), abs=2e-3)


def test_the_campaign_is_wide():
    sizes = {case.phase.network.pressed.shape for case in CASES}
    assert len(CASES) >= 30
    assert {(8, 8), (64, 64)} <= sizes
    assert len({case.circuit for case in CASES}) >= 30


@pytest.mark.campaign
@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case.phase.name} {case.pattern}")
def test_circuits_of_all_kinds(case):
    check(case)
