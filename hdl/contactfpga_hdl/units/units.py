"""Pressure units between converter, commands, contact pin and link: connections only."""

from amaranth.hdl import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.wire.command import MOST_VALUE, MOST_WHAT
from contactfpga_hdl.units.pack import UnitPacker, packet_signature
from contactfpga_hdl.units.ports import unit_pins
from contactfpga_hdl.units.watch import Watch


class Units(wiring.Component):
    """Sweeps of the converter, a packet for each; ``over`` follows a unit's reading by two clocks, the last sum's by up
    to seven, the packet's ``due`` as in docs/timing.md.

    pins: pins at the converter.
    command, what, value (in): see :class:`~contactfpga_hdl.units.watch.Settings`.
    over, armed (out): see :class:`~contactfpga_hdl.units.watch.Watch`.
    packet (out): see :func:`~contactfpga_hdl.units.pack.packet_signature`.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        super().__init__(
            {
                "pins": Out(wiring.Signature(unit_pins(skin))),
                "command": In(1),
                "what": In(range(MOST_WHAT + 1)),
                "value": In(range(MOST_VALUE + 1)),
                "over": Out(1),
                "armed": Out(1),
                "packet": Out(packet_signature()),
            }
        )

    def elaborate(self, platform):
        m = Module()
        m.submodules.converter = converter = self.skin.derived.units.converter.load_gateware()(self.skin)
        m.submodules.watch = watch = Watch(self.skin)
        m.submodules.packer = packer = UnitPacker(self.skin)
        wiring.connect(m, converter.pins, wiring.flipped(self.pins))
        wiring.connect(m, packer.packet, wiring.flipped(self.packet))
        m.d.comb += [
            watch.done.eq(converter.done),
            watch.reading.eq(converter.reading),
            watch.command.eq(self.command),
            watch.what.eq(self.what),
            watch.value.eq(self.value),
            packer.sampled.eq(converter.sampled),
            packer.done.eq(converter.done),
            packer.reading.eq(converter.reading),
            packer.over.eq(watch.over),
            packer.armed.eq(watch.armed),
            self.over.eq(watch.over),
            self.armed.eq(watch.armed),
        ]
        return m
