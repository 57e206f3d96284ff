"""Whether a unit's deviation from its zero, or a weighted sum of deviations, has reached its threshold."""

from amaranth.hdl import Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga.wire.command import MOST_VALUE, MOST_WHAT
from contactfpga_hdl.units.ports import reading_layout
from contactfpga_hdl.units.settings import Settings
from contactfpga_hdl.units.sums import Sums


class Watch(wiring.Component):
    """Each unit is compared with each of its readings, each sum once a sweep.

    done, reading (in): of the converter.
    command, what, value (in): see :class:`~contactfpga_hdl.units.settings.Settings`.
    over (out): a threshold is reached. A unit's counts two clocks after ``done``, sum k's four + k clocks after that of
    the sweep's last unit, and stands until the next comparison.
    armed (out): there is a threshold.
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
        deviation = Signal(signed(Derived(self.skin).units.converter.bits + 1))
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
        m.d.sync += compares.eq(self.done)
        with m.If(self.done):
            m.d.sync += deviation.eq(self.reading.value - settings.zero)
        with m.If(compares):
            reached = settings.watched & (amount >= settings.threshold)
            m.d.sync += of_units.bit_select(self.reading.unit, 1).eq(reached)
        if not self.skin.unit_sums:
            m.d.comb += self.over.eq(of_units.any())
            return m
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
