"""The lines of the kits' sheets in ngspice, at corners of temperature and supply: the Skins' times are enough."""

import pytest

from contactfpga.design import kits
from contactfpga.design.circuit import load_circuit, needed_by, patterns, phases
from contactfpga.design.circuit.network import Network
from contactfpga.design.circuit.phases import Levels
from contactfpga.design.sheet.extract import extracted
from contactfpga_sim.model.sheet import agreement

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not agreement.installed(), reason="ngspice is not installed"),
]
CELSIUS = (-20, 70)
SUPPLY = (3.0, 3.6)
PHASES = {
    "settle": lambda network, levels: phases.settle(network, levels),
    "precharge": lambda network, levels: phases.precharge(network, 40e-9),
    "project": lambda network, levels: phases.project_rows(network, levels),
}


@pytest.mark.parametrize(("celsius", "supply_v"), [*zip(CELSIUS, SUPPLY)])
@pytest.mark.parametrize("name", [name for name in kits.names() if not kits.kit(name).skin.ruler])
def test_times_are_enough_at_the_corners(name, celsius, supply_v):
    skin = kits.kit(name).skin
    circuit = extracted(kits.kit(name).layout).circuit.replace(supply_v=supply_v)
    needs = needed_by(skin, circuit)
    for what in PHASES if skin.reads_rows else ("settle", "precharge"):
        pattern = getattr(needs, what).pattern
        network = Network(circuit, patterns.named(skin.row_lines, skin.column_lines)[pattern])
        phase = PHASES[what](network, Levels.of(circuit, skin.diodes))
        given_s = 1e-6 * getattr(skin, f"{what}_us")
        seconds, volts = agreement.run(phase, given_s, celsius=celsius)
        assert phase.arrived(seconds, volts).max() < given_s, (what, pattern)


def test_a_colder_diode_is_another_one():
    """The corner is one: temperature reaches the diodes."""
    circuit = load_circuit(kits.kit("starter").skin_path)
    phase = phases.settle(Network(circuit, patterns.named(4, 4)["one row"]), Levels.of(circuit))
    levels = [agreement.run(phase, 2e-6, celsius=celsius)[1][-1, 0] for celsius in CELSIUS]
    assert levels[0] > levels[1] + 0.03
