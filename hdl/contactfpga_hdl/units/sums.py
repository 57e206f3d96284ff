"""Weighted sums of the units' deviations, compared with thresholds at the end of each sweep."""

from amaranth.hdl import Array, Const, Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga.skin.units import INDEX_BITS, MAX_WEIGHT


class Sums(wiring.Component):
    """One multiplier takes the sums in turn, a clock each, while their totals go round.

    taken (in): high for a clock; then ``deviation`` is that of ``unit``, and stays for as many clocks as there are
    sums. ``last``: of the sweep's last unit.
    sum (out): whose ``threshold`` and ``watched`` (in) are wanted in this clock.
    over (out): a bit for each sum, three clocks after its turn in the last unit's.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        units = Derived(skin).units
        self._bits, self._total = units.converter.bits, signed(units.sum_bits + 1)
        super().__init__(
            {
                "taken": In(1),
                "deviation": In(signed(self._bits + 1)),
                "unit": In(INDEX_BITS),
                "last": In(1),
                "sum": Out(2),
                "threshold": In(units.sum_bits),
                "watched": In(1),
                "over": Out(len(skin.unit_sums)),
            }
        )

    def elaborate(self, platform):
        m = Module()
        rows = self.skin.unit_sums
        count = len(rows)
        turn, busy = Signal(2), Signal()
        multiplies, adds, compares = Signal(), Signal(), Signal()
        ongoing = multiplies & (turn != count - 1)
        m.d.comb += multiplies.eq(self.taken | busy)
        m.d.sync += [busy.eq(ongoing), turn.eq(Mux(ongoing, turn + 1, 0)), adds.eq(multiplies)]
        table = [[Const(rows[index][unit], signed(8)) for unit in range(self.skin.units)] for index in range(count)]
        assert MAX_WEIGHT < 128
        weight = Signal(signed(8))
        m.d.comb += weight.eq(Array([Array(row)[self.unit] for row in table])[turn])
        product = Signal(signed(self._bits + 9))
        first, last = Signal(), Signal()
        m.d.sync += [product.eq(self.deviation * weight), first.eq(self.unit == 0), last.eq(self.last)]
        totals = [Signal(self._total, name=f"total_{index}") for index in range(count)]
        added = Signal(self._total)
        m.d.comb += added.eq(Mux(first, 0, totals[0]) + product)
        with m.If(adds):  # they go round, so that the next one is in front
            m.d.sync += [total.eq(after) for total, after in zip(totals, [*totals[1:], added], strict=True)]
        # High for as many clocks in a row as there are sums.
        m.d.sync += [compares.eq(adds & last), self.sum.eq(Mux(compares, self.sum + 1, 0))]
        total = totals[-1]
        amount = Mux(total < 0, -total, total)
        with m.If(compares):
            reached = self.watched & (amount.as_unsigned() >= self.threshold)
            m.d.sync += self.over.bit_select(self.sum, 1).eq(reached)
        return m
