"""What the host sets by commands: zeros and thresholds (docs/units.md). At power-up no threshold is set."""

from amaranth.hdl import Array, Cat, Module, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga.skin.units import INDEX_BITS, NUMBER_BITS, SUM_THRESHOLD, THRESHOLD, ZERO, number_shift
from contactfpga.wire.command import MOST_VALUE, MOST_WHAT


class Settings(wiring.Component):
    """Registers, so that a restart of two copies clears them.

    command (in): high for a clock; ``what`` and ``value`` are then a command's. Those of units and sums that are not
    there do nothing.
    unit (in): whose ``zero`` and ``threshold`` are looked at; ``watched``: it has a threshold.
    sum (in), with sums: likewise.
    armed (out): there is a threshold.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        units = Derived(skin).units
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
        """What commands set, and whether it is not 0."""
        values = [Signal(bits, name=f"{name}_{index}") for index in range(count)]
        given = [Signal(name=f"{name}_{index}_given") for index in range(count)]
        index, number = self.value[:INDEX_BITS], self.value[INDEX_BITS:]
        scaled = Value.cast(number << number_shift(bits))[:bits]
        assert len(number) == NUMBER_BITS
        for place in range(count):
            with m.If(self.command & (self.what == what) & (index == place)):
                m.d.sync += [values[place].eq(scaled), given[place].eq(number != 0)]
        return Array(values), Array(given)
