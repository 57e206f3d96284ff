"""Thresholds on the deviations of units from their zeros, and on weighted sums of deviations."""

from amaranth.hdl import Array, Cat, Const, Module, Mux, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.units import INDEX_BITS, MAX_WEIGHT, NUMBER_BITS, SUM_THRESHOLD, THRESHOLD, ZERO, number_shift
from contactfpga.wire.command import MOST_VALUE, MOST_WHAT
from contactfpga_hdl.units.ports import reading_layout


class Watch(wiring.Component):
    """Compares each unit at each of its readings, and each sum once per sweep.

    done, reading (in): from the converter.
    command, what, value (in): see :class:`Settings`.
    over (out): a threshold is reached, until the next comparison; for a unit from two clocks after ``done``, for sum k
        from 4 + k clocks after ``done`` of the sweep's last unit.
    armed (out): a threshold is set.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        super().__init__(
            {
                "done": In(1),
                "reading": In(reading_layout(skin)),
                "command": In(1),
                "what": In(range(MOST_WHAT + 1)),
                "value": In(range(MOST_VALUE + 1)),
                "over": Out(1),
                "armed": Out(1),
            }
        )

    def elaborate(self, platform):
        m = Module()
        m.submodules.settings = settings = Settings(self.skin)
        deviation = Signal(signed(self.skin.derived.units.converter.bits + 1))
        compares = Signal()
        of_units = Signal(self.skin.units)
        amount = Mux(deviation < 0, -deviation, deviation).as_unsigned()
        m.d.comb += [
            settings.command.eq(self.command),
            settings.what.eq(self.what),
            settings.value.eq(self.value),
            settings.unit.eq(self.reading.unit),
            self.armed.eq(settings.armed),
        ]
        # Comparison of a reading
        m.d.sync += compares.eq(self.done)
        with m.If(self.done):
            m.d.sync += deviation.eq(self.reading.value - settings.zero)
        with m.If(compares):
            reached = settings.watched & (amount >= settings.threshold)
            m.d.sync += of_units.bit_select(self.reading.unit, 1).eq(reached)
        if not self.skin.unit_sums:
            m.d.comb += self.over.eq(of_units.any())
            return m
        # Comparison of sums
        m.submodules.sums = sums = Sums(self.skin)
        m.d.comb += [
            sums.taken.eq(compares),
            sums.deviation.eq(deviation),
            sums.unit.eq(self.reading.unit),
            sums.last.eq(self.reading.last),
            settings.sum.eq(sums.sum),
            sums.threshold.eq(settings.sum_threshold),
            sums.watched.eq(settings.sum_watched),
            self.over.eq(of_units.any() | sums.over.any()),
        ]
        return m


class Settings(wiring.Component):
    """Zeros and thresholds in registers, so that a restart of two copies clears them.

    command (in): pulse with a command; ``what`` and ``value`` (in) are ignored for absent units and sums.
    unit (in): selects ``zero``, ``threshold``, and ``watched``, whether there is a threshold (out).
    sum (in), with sums: likewise for a sum.
    armed (out): a threshold is set.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        units = skin.derived.units
        self._bits, self._sum_bits = units.converter.bits, units.sum_bits
        sums = {"sum": In(2), "sum_threshold": Out(self._sum_bits), "sum_watched": Out(1)} if skin.unit_sums else {}
        super().__init__(
            {
                "command": In(1),
                "what": In(range(MOST_WHAT + 1)),
                "value": In(range(MOST_VALUE + 1)),
                "unit": In(INDEX_BITS),
                "zero": Out(self._bits),
                "threshold": Out(self._bits),
                "watched": Out(1),
                **sums,
                "armed": Out(1),
            }
        )

    def elaborate(self, platform):
        m = Module()
        units, sums = self.skin.units, len(self.skin.unit_sums)
        zeros, _ = self._registers(m, "zero", ZERO, units, self._bits)
        thresholds, watched = self._registers(m, "threshold", THRESHOLD, units, self._bits)
        m.d.comb += [
            self.zero.eq(zeros[self.unit]),
            self.threshold.eq(thresholds[self.unit]),
            self.watched.eq(watched[self.unit]),
        ]
        some = Cat(watched)
        if sums:
            thresholds, of_sums = self._registers(m, "sum_threshold", SUM_THRESHOLD, sums, self._sum_bits)
            m.d.comb += [self.sum_threshold.eq(thresholds[self.sum]), self.sum_watched.eq(of_sums[self.sum])]
            some = Cat(some, of_sums)
        m.d.comb += self.armed.eq(some.any())
        return m

    def _registers(self, m: Module, name: str, what: int, count: int, bits: int) -> tuple[Array, Array]:
        values = [Signal(bits, name=f"{name}_{index}") for index in range(count)]
        given = [Signal(name=f"{name}_{index}_given") for index in range(count)]
        index, number = self.value[:INDEX_BITS], self.value[INDEX_BITS:]
        scaled = Value.cast(number << number_shift(bits))[:bits]
        assert len(number) == NUMBER_BITS
        for place in range(count):
            with m.If(self.command & (self.what == what) & (index == place)):
                m.d.sync += [values[place].eq(scaled), given[place].eq(number != 0)]
        return Array(values), Array(given)


class Sums(wiring.Component):
    """One multiplier computes the sums in turn, a clock each, while their totals rotate.

    taken (in): pulse with a ``deviation`` of ``unit``, which are stable for as many clocks as there are sums.
    last (in): the deviation is of the sweep's last unit.
    sum (out): number of the sum whose ``threshold`` and ``watched`` (in) are needed in this clock.
    over (out): a bit per sum, three clocks after its product with the last unit.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        units = skin.derived.units
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
        number, busy = Signal(2), Signal()
        multiplies, adds, compares = Signal(), Signal(), Signal()
        ongoing = multiplies & (number != count - 1)
        m.d.comb += multiplies.eq(self.taken | busy)
        m.d.sync += [busy.eq(ongoing), number.eq(Mux(ongoing, number + 1, 0)), adds.eq(multiplies)]
        # Product
        table = [[Const(rows[index][unit], signed(8)) for unit in range(self.skin.units)] for index in range(count)]
        assert MAX_WEIGHT < 128
        weight = Signal(signed(8))
        m.d.comb += weight.eq(Array([Array(row)[self.unit] for row in table])[number])
        product = Signal(signed(self._bits + 9))
        first, last = Signal(), Signal()
        m.d.sync += [product.eq(self.deviation * weight), first.eq(self.unit == 0), last.eq(self.last)]
        # Totals
        totals = [Signal(self._total, name=f"total_{index}") for index in range(count)]
        added = Signal(self._total)
        m.d.comb += added.eq(Mux(first, 0, totals[0]) + product)
        with m.If(adds):  # they go round, so that the next one is in front
            m.d.sync += [total.eq(after) for total, after in zip(totals, [*totals[1:], added], strict=True)]
        # High for as many clocks in a row as there are sums.
        m.d.sync += [compares.eq(adds & last), self.sum.eq(Mux(compares, self.sum + 1, 0))]
        # Comparison, from the first sum on
        total = totals[-1]
        amount = Mux(total < 0, -total, total)
        with m.If(compares):
            reached = self.watched & (amount.as_unsigned() >= self.threshold)
            m.d.sync += self.over.bit_select(self.sum, 1).eq(reached)
        return m
