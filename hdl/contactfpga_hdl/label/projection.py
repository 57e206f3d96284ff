"""Zones from their shadows on the two axes: small, and wrong where shadows cross.

Adjacent rows with a pressed cell form a *band*; the columns with a pressed cell in a band, its shadow, form runs. The
cells above one run are one zone. So two contacts whose shadows touch are merged, and a ring includes its interior. A
connected contact is never split; the moments of these zones are exact.
"""

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import data, memory, wiring

from contactfpga.skin import Skin
from contactfpga_hdl.payloads import labeller_ports, moments_layout, row_number


def _step_layout() -> data.StructLayout:
    return data.StructLayout({"valid": 1, "cell": 1, "shadow": 1, "stop": 1, "closes": 1, "end": 1})


class ProjectionLabeller(wiring.Component):
    """Rows in, zone records out, one column per clock; ports as in :func:`~contactfpga_hdl.payloads.labeller_ports`.

    A row of C columns takes C + 1 clocks, an empty row outside a band one. A band closes with the empty row after it or
    with the frame's last row, handed over in clock h; the zone whose shadow ends in column x leaves in clock h + x + 3.
    """

    def __init__(self, skin: Skin):
        self.derived = skin.derived
        super().__init__(labeller_ports(self.derived))

    def elaborate(self, platform):
        m = Module()
        enable = Signal()  # no record waits
        m.d.comb += enable.eq(~self.records.valid | self.records.ready)
        # Walk over the columns of a row and of its band's shadow
        step = Signal(_step_layout())
        column = Signal(range(max(2, self.derived.skin.columns)))
        y = Signal(range(max(2, self.derived.skin.rows)))
        columns = self.derived.skin.columns
        row = self.rows.payload
        cells, shadow = Signal(columns), Signal(columns)  # both move on by one column per clock
        walks, closes, last = Signal(), Signal(), Signal()
        in_band = Signal()
        final = column == columns - 1
        m.d.comb += [
            self.rows.ready.eq(enable & ~walks),
            step.valid.eq(walks),
            step.cell.eq(cells[0]),
            step.shadow.eq(shadow[0]),
            step.stop.eq(final | ~(cells | shadow)[1:2].any()),
            step.closes.eq(closes),
            step.end.eq(last & ~walks),
        ]
        with m.If(enable & walks):
            turned = (cells | shadow)[0] & ~closes
            m.d.sync += [
                cells.eq(cells >> 1),
                shadow.eq(Cat(shadow, turned)[1:]),
                column.eq(column + 1),
                walks.eq(~final),
            ]
        with m.Elif(enable):
            m.d.sync += last.eq(0)
        taken = self.rows.valid & self.rows.ready
        number = row_number(m, self.derived, row, taken)
        with m.If(taken):
            pressed = row.cells.any()
            m.d.sync += [
                cells.eq(row.cells),
                last.eq(row.last),
                closes.eq(row.last | ~pressed),
                walks.eq(in_band | pressed),
                in_band.eq(pressed & ~row.last),
                column.eq(0),
                y.eq(number),
            ]
        # Each column's moments in the band, one clock after the walk
        layout = moments_layout(self.derived)
        m.submodules.sums = sums = memory.Memory(shape=layout, depth=self.derived.skin.columns, init=[])
        read, write = sums.read_port(), sums.write_port()
        read_step, x = Signal.like(step), Signal.like(column)
        with m.If(enable):
            m.d.sync += [read_step.eq(step), x.eq(column)]
        for name, share in (("area", 1), ("sum_x", x), ("sum_y", y)):
            m.d.comb += write.data[name].eq(Mux(read_step.shadow, read.data[name], 0) + Mux(read_step.cell, share, 0))
        m.d.comb += [
            read.en.eq(enable),
            read.addr.eq(column),
            write.en.eq(enable & read_step.valid & read_step.cell),
            write.addr.eq(x),
        ]
        added, total = Signal.like(step), Signal(layout)
        with m.If(enable):
            m.d.sync += [added.eq(read_step), total.eq(write.data)]
        # Zones: the columns of one run, added up
        kept, zone = Signal.like(total), Signal.like(total)
        ends_band = added.valid & added.closes
        leaves = ends_band & (added.cell | added.shadow) & added.stop
        for name in ("area", "sum_x", "sum_y"):
            m.d.comb += zone[name].eq(kept[name] + total[name])
        with m.If(enable):
            m.d.sync += kept.eq(Mux(ends_band & ~leaves, zone.as_value(), 0))
        m.d.comb += [
            self.records.valid.eq(leaves | added.end),
            self.records.payload.zone.eq(zone),
            self.records.payload.end.eq(added.end),
        ]
        return m
