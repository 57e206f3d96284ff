"""Divide: barycenters instead of sums, and when the packer can have them."""

from __future__ import annotations

from fractions import Fraction

from contactfpga_sim.model.golden.facts import Facts
from contactfpga_sim.model.golden.frame import Queue, join
from contactfpga_sim.model.golden.trace import Trace


def barycenter(total: int, area: int, fraction_bits: int) -> int:
    """The nearest step of 1/2^fraction_bits to total / area, half a step upward."""
    return int(Fraction(total * 2**fraction_bits, area) + Fraction(1, 2))


class Divider(Queue):
    """Divides one zone at a time; items are noted in a trace as the packer takes them."""

    def __init__(self, facts: Facts, trace: Trace):
        self._facts = facts
        self._trace = trace
        self._free = 0
        """From when on a zone can begin."""
        self._gone = 0
        """When the item before was taken."""

    def offer(self, put: int, data: int) -> tuple[int, int]:
        begun = max(self._free, put + 2)
        last_bit = max(begun + self._facts.division, self._gone)
        self._free = last_bit + 1
        return last_bit + 1, self._item(data)

    def take(self, cycle: int, item: int) -> None:
        self._gone = cycle
        self._trace.items.append((cycle, item, False))

    def pass_end(self, cycle: int) -> None:
        self._free = cycle + 1
        self._trace.items.append((cycle, 0, True))

    def _item(self, data: int) -> int:
        facts = self._facts
        area, rest = data % 2**facts.area_bits, data // 2**facts.area_bits
        sum_x, sum_y = rest % 2**facts.sum_x_bits, rest // 2**facts.sum_x_bits
        x, y = (barycenter(total, area, facts.skin.barycenter_bits) for total in (sum_x, sum_y))
        widths = facts.barycenter_bits
        return join(((area % 2 ** widths[0], widths[0]), (x, widths[1]), (y, widths[2])))[0]
