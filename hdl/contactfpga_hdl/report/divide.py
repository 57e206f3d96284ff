"""Barycenters: each zone's sums divided by its area, while later rows arrive and bytes are sent.

x = floor(sum_x 2^k / area + 1/2), k being the Skin's ``barycenter_bits``, and y likewise: the nearest step of 1/2^k of
a cell. Restoring division (shift, subtract if possible) computes x and y in parallel, with one bit more; adding that
bit rounds. A barycenter is on the sheet, so the bits of a sum beyond those of a row or column number are less than the
area, and are the initial remainder.

One divider for x and y in turn would save 18 LUT4 on an iCE40UP5K with 16x16 cells and 4 fraction bits (71, not 89), 22
with 64x64 (91, not 113), but take twice the clocks, too many for a dense frame's zones.
"""

from amaranth.hdl import Cat, Module, Mux, Signal, Value
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga_hdl.payloads import extent_layout, item_layout, record_layout


def barycenter_layout(derived: Derived) -> data.StructLayout:
    """Area, without the bits that all areas of the sheet share, barycenter and extent: a record on the wire with
    ``report = "barycenter"``."""
    return data.StructLayout(dict(zip(("area", "x", "y"), derived.record_bits)) | extent_layout(derived))


class Divider(wiring.Component):
    """One zone at a time, one bit per clock: the item of a zone offered in clock t is offered from ``t + Q + 1``, with
    Q = ``Derived.quotient_bits``, and the next zone can begin in that clock.

    While an item waits, the next zone is divided up to its last bit, with which a zone is taken. An end mark passes
    without delay when no item is before it.

    records (in): zones and end marks.
    items (out): area and barycenter of each, in order.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = skin.derived
        super().__init__(
            {
                "records": In(stream.Signature(record_layout(self.derived))),
                "items": Out(stream.Signature(item_layout(self.derived))),
            }
        )

    def elaborate(self, platform):
        m = Module()
        bits = self.derived.quotient_bits
        zone, end = self.records.payload.zone, self.records.payload.end
        quotients = data.StructLayout({"x": bits, "y": bits})
        found = Signal(quotients)  # with the bit that is worked out in this clock
        left = Signal(range(bits + 1))  # bits to come, 0 while no zone is divided
        waits = Signal()  # an item does, that of these
        area = Signal(barycenter_layout(self.derived)["area"].shape)
        extent = {name: Signal(width, name=f"waiting_{name}") for name, width in extent_layout(self.derived).items()}
        waiting = Signal(quotients)
        begins = self.records.valid & ~end & (left == 0)
        free = ~waits | self.items.ready
        last = left == 1
        steps = (left != 0) & (~last | free)
        # Division of both sums
        for name in ("x", "y"):
            m.d.comb += found[name].eq(self._divide(m, name, zone[f"sum_{name}"], zone.area, begins, steps))
        # Steps, and the item that waits
        with m.If(begins):
            m.d.sync += left.eq(bits)
        with m.If(steps):
            m.d.sync += left.eq(left - 1)
        with m.If(free):
            m.d.sync += waits.eq(last)
        with m.If(last & free):
            m.d.sync += [area.eq(zone.area), waiting.eq(found), *(extent[name].eq(zone[name]) for name in extent)]
        # Streams
        m.d.comb += [
            self.records.ready.eq(Mux(end, ~waits & self.items.ready, last & free)),
            self.items.valid.eq(waits | self.records.valid & end),
            self.items.payload.end.eq(~waits),
            self.items.payload.data.eq(Cat(area, self._rounded(m, waiting), *extent.values())),
        ]
        return m

    def _divide(self, m: Module, name: str, total: Value, area: Value, begins: Value, steps: Value) -> Value:
        """Registers of one axis; returns the quotient's bits, the last computed in this clock."""
        whole = self.derived.cell_bits
        # Kept inverted, so that adding the area subtracts it and no carry is left where it fits.
        remainder = Signal(self.derived.area_bits, name=f"{name}_remainder")
        bits = Signal(self.derived.quotient_bits, name=f"{name}_bits")  # of the sum, and from below of the quotient
        begun = Signal.like(remainder, name=f"{name}_begun")  # as wide as that, before it is inverted
        shifted = Cat(~bits[-1], remainder)
        less = Signal(len(shifted) + 1, name=f"{name}_less")
        fits = ~less[-1]
        m.d.comb += [begun.eq(total >> whole), less.eq(shifted + area)]
        with m.If(begins):
            m.d.sync += [remainder.eq(~begun), bits.eq(total[:whole] << len(bits) - whole)]
        with m.If(steps):
            m.d.sync += [remainder.eq(Mux(fits, less, shifted)), bits.eq(Cat(fits, bits))]
        return Cat(fits, bits)

    def _rounded(self, m: Module, quotients: data.View) -> Value:
        layout = barycenter_layout(self.derived)
        return Cat(((quotients[name] + 1) >> 1)[: layout[name].width] for name in ("x", "y"))
