"""Several sheets on one FPGA, each with its own gateware, and one UART."""

from amaranth.hdl import Cat, Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin.several import Several
from contactfpga.wire.sheet_number import SheetPlace
from contactfpga_hdl.link.uart import Transmitter
from contactfpga_hdl.top import Top, receiver_of

_INSIDE = ("bits", "bytes", "grant", "holds", "contact")


class SeveralTop(wiring.Component):
    """A :class:`Top` per sheet; pins and probes end with the sheet's number, as ``row_data_0``. ``tx``, ``rx`` and
    ``contact`` are shared; ``contact`` is high in the clock after one in which any sheet's is.

    A sheet keeps its newest frame until it may send.
    """

    def __init__(self, several: Several, probes: bool = False):
        self.several = several
        count = len(several.skins)
        self.sheets = [Top(skin, probes, place=SheetPlace(number, count)) for number, skin in enumerate(several.skins)]
        shared = {"tx": Out(1, init=1), "rx": In(1, init=1), "contact": Out(1)}
        super().__init__(shared | {f"{name}_{number}": member for number, name, member in self._outside()})

    def elaborate(self, platform):
        m = Module()
        derived = self.several.skins[0].derived  # its rates are those of all
        m.submodules.transmitter = transmitter = Transmitter(derived.bit_clocks)
        m.submodules.receiver = receiver = receiver_of(derived)
        m.submodules.grants = grants = RoundRobin(len(self.sheets))
        # Shared pins
        m.d.comb += [
            self.tx.eq(transmitter.pin),
            receiver.pin.eq(self.rx),
            grants.holds.eq(Cat(sheet.holds for sheet in self.sheets)),
        ]
        # One may be let go as another is touched: a register keeps that from the pin.
        m.d.sync += self.contact.eq(Cat(sheet.contact for sheet in self.sheets).any())
        # Line of the sheet that has the grant
        for number, sheet in enumerate(self.sheets):
            m.submodules[f"sheet_{number}"] = sheet
            m.d.comb += [sheet.grant.eq(grants.grant[number]), sheet.bytes.ready.eq(transmitter.bytes.ready)]
            m.d.comb += [
                getattr(sheet.bits, name).eq(getattr(receiver.bits, name)) for name in receiver.bits.signature.members
            ]
            with m.If(grants.grant[number]):
                m.d.comb += [
                    transmitter.bytes.valid.eq(sheet.bytes.valid),
                    transmitter.bytes.payload.eq(sheet.bytes.payload),
                ]
        # Pins of each sheet
        for number, name, member in self._outside():
            inside, outside = getattr(self.sheets[number], name), getattr(self, f"{name}_{number}")
            m.d.comb += outside.eq(inside) if member.flow == Out else inside.eq(outside)
        return m

    def _outside(self):
        for number, sheet in enumerate(self.sheets):
            for name, member in sheet.signature.members.items():
                if name not in _INSIDE:
                    yield number, name, member


class RoundRobin(wiring.Component):
    """Grants the line to the sheets in turn. A sheet with the grant may begin a packet, and has the grant to its end; a
    sheet with nothing to send passes the grant on in the same clock. So a sheet waits for at most one packet of each
    other sheet.

    holds (in), by sheet: a packet begins in this clock, or does not end in it; ignored without the grant.
    grant (out), by sheet: a packet may begin; high for one sheet in each clock, for the first one after power-up.
    """

    def __init__(self, sheets: int):
        self.sheets = sheets
        super().__init__({"holds": In(sheets), "grant": Out(sheets)})

    def elaborate(self, platform):
        m = Module()
        others = Signal(self.sheets - 1)  # by sheet after the first one; none: the first one has the grant
        m.d.comb += self.grant.eq(Cat(~others.any(), others))
        with m.If(~(self.grant & self.holds).any()):
            m.d.sync += others.eq(self.grant)
        return m
