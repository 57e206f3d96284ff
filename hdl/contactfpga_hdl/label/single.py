"""All pressed cells as one zone: the smallest labeller, enough for a single contact."""

from amaranth.hdl import Module, Signal
from amaranth.lib import wiring

from contactfpga.skin import Skin
from contactfpga_hdl.payloads import labeller_ports, moments_layout, row_number


class SingleLabeller(wiring.Component):
    """Rows in, at most one zone record per frame out, one column per clock; ports as in
    :func:`~contactfpga_hdl.payloads.labeller_ports`.

    A row of C columns takes C + 2 clocks, an empty one one, unless it is the last row of a frame with a pressed cell.
    If that is handed over in clock h, the zone leaves in clock h + C + 2.
    """

    def __init__(self, skin: Skin):
        self.derived = skin.derived
        super().__init__(labeller_ports(self.derived))

    def elaborate(self, platform):
        m = Module()
        skin = self.derived.skin
        row = self.rows.payload
        enable = ~self.records.valid | self.records.ready
        cells, x = Signal(skin.columns), Signal(range(skin.columns + 1))
        y = Signal(range(max(2, skin.rows)))
        zone = Signal(moments_layout(self.derived))
        walks, last, pressed = Signal(), Signal(), Signal()
        leaves, ends, end = Signal(), Signal(), Signal()
        final = x == skin.columns  # a clock after the last column, so that the zone holds while it leaves
        m.d.comb += self.rows.ready.eq(enable & ~walks)
        # Walk over the columns of a row
        with m.If(enable):
            m.d.sync += [leaves.eq(walks & final & last), ends.eq(~walks & last), end.eq(ends)]
            with m.If(leaves):
                m.d.sync += zone.eq(0)
        with m.If(enable & walks):
            m.d.sync += [cells.eq(cells >> 1), x.eq(x + 1), walks.eq(~final)]
            with m.If(cells[0]):
                m.d.sync += [zone.area.eq(zone.area + 1), zone.sum_x.eq(zone.sum_x + x), zone.sum_y.eq(zone.sum_y + y)]
        with m.Elif(enable):
            m.d.sync += last.eq(0)
        # Next row
        taken = self.rows.valid & self.rows.ready
        number = row_number(m, self.derived, row, taken)
        with m.If(taken):
            any_pressed = pressed | row.cells.any()
            m.d.sync += [
                cells.eq(row.cells),
                x.eq(0),
                y.eq(number),
                last.eq(row.last),
                pressed.eq(any_pressed & ~row.last),
                walks.eq(row.cells.any() | row.last & any_pressed),
            ]
        # Record
        m.d.comb += [
            self.records.valid.eq(leaves | end),
            self.records.payload.zone.eq(zone),
            self.records.payload.end.eq(end),
        ]
        return m
