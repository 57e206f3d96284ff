"""Sums of units at their thresholds: from which amount on they are over, to the last step, either way."""

import numpy as np

from contactfpga import Skin
from contactfpga.skin.units import SUM_THRESHOLD, ZERO
from contactfpga_hdl.units.watch import Watch

SUMS = [[1, 1, 1], [2, -3, 1], [0, 0, -5], [1, -2, 1]]
"""Of so few bits that thresholds are given in steps of 1."""
EPOCHS, EPOCH, READ = 200, 32, (8, 14, 20)
"""How many, of how many clocks; when in each of them a unit is read."""


def test_a_sum_is_over_from_its_threshold_on_to_the_last_step(bench):
    """Zeros, then a threshold of one sum at, or one off, the amount of the readings that come; the others have none."""
    rng = np.random.default_rng(3)
    zeros, read = rng.integers(4096, size=(2, EPOCHS, 3))
    orders, expected, before = {}, [], 0
    for epoch in range(EPOCHS):
        place = int(rng.integers(4))
        amount = abs(int(SUMS[place] @ (read[epoch] - zeros[epoch])))
        number = max(1, amount + int(rng.integers(-1, 2)))
        given = [*((ZERO, unit, int(zeros[epoch, unit])) for unit in range(3)), (SUM_THRESHOLD, before, 0)]
        for cycle, (what, index, value) in enumerate([*given, (SUM_THRESHOLD, place, number)], epoch * EPOCH):
            orders[cycle] = what, index | value << 3
        expected.append(int(amount >= number))
        before = place

    def unit(cycle):
        return sum(cycle % EPOCH >= start for start in READ[1:])

    dut = Watch(Skin(units=3, unit_sums=SUMS))
    sim = bench(dut)
    sim.drive(dut.command, lambda cycle: int(cycle in orders))
    sim.drive(dut.what, lambda cycle: orders.get(cycle, (0, 0))[0])
    sim.drive(dut.value, lambda cycle: orders.get(cycle, (0, 0))[1])
    sim.drive(dut.done, lambda cycle: int(cycle % EPOCH in READ))
    sim.drive(dut.reading.unit, unit)
    sim.drive(dut.reading.value, lambda cycle: int(read[cycle // EPOCH % EPOCHS, unit(cycle)]))
    sim.drive(dut.reading.last, lambda cycle: int(unit(cycle) == 2))
    over = sim.watch(dut.over)
    sim.run(EPOCHS * EPOCH)
    assert over.values[EPOCH - 1 :: EPOCH] == expected
    assert 40 < sum(expected) < 160
