"""Zones from their shadows on the two axes: small, and wrong where shadows cross.

The rows with a pressed cell fall into *bands* of adjacent rows. Within a band the columns that have a pressed cell, its
shadow, fall into runs; the cells above one run are taken as one zone. So two contacts in one band whose shadows
touch come out as one, and a ring comes out with what lies inside it. A contact whose cells are connected is never
split, and the moments of what is taken as a zone are exact.
"""

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import data, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga_hdl.payloads import moments_layout, record_layout, row_layout


class ProjectionLabeller(wiring.Component):
    """Rows in, zone records out; a column a clock.

    A row of C columns takes C + 1 clocks, an empty one outside a band one. A band closes with the empty row behind it
    or with the frame's last row, handed over in clock h; the zone whose shadow ends in column x leaves in clock
    h + x + 3.
    """

    def __init__(self, skin: Skin):
        self.derived = Derived(skin)
        super().__init__(
            {
                "rows": In(stream.Signature(row_layout(self.derived))),
                "records": Out(stream.Signature(record_layout(self.derived))),
            }
        )

    def elaborate(self, platform):
        m = Module()
        self._enable = Signal()
        m.d.comb += self._enable.eq(~self.records.valid | self.records.ready)
        step = data.StructLayout({"valid": 1, "cell": 1, "shadow": 1, "stop": 1, "closes": 1, "end": 1})
        self._step = Signal(step)  # a column of the row, or behind the last row the end mark
        self._column = Signal(range(max(2, self.derived.skin.columns)))
        self._y = Signal(range(max(2, self.derived.skin.rows)))
        self._walk_columns(m)
        self._add_cells(m)
        self._let_out(m)
        return m

    def _walk_columns(self, m):
        columns = self.derived.skin.columns
        row = self.rows.payload
        cells, shadow = Signal(columns), Signal(columns)  # both are turned by a column a clock
        walks, closes, last = Signal(), Signal(), Signal()
        y_next = Signal.like(self._y)
        in_band = Signal()
        final = self._column == columns - 1
        m.d.comb += [
            self.rows.ready.eq(self._enable & ~walks),
            self._step.valid.eq(walks),
            self._step.cell.eq(cells[0]),
            self._step.shadow.eq(shadow[0]),
            self._step.stop.eq(final | ~(cells | shadow)[1:2].any()),
            self._step.closes.eq(closes),
            self._step.end.eq(last & ~walks),
        ]
        with m.If(self._enable & walks):
            turned = (cells | shadow)[0] & ~closes
            m.d.sync += [
                cells.eq(cells >> 1),
                shadow.eq(Cat(shadow, turned)[1:]),
                self._column.eq(self._column + 1),
                walks.eq(~final),
            ]
        with m.Elif(self._enable):
            m.d.sync += last.eq(0)
        with m.If(self.rows.valid & self.rows.ready):
            pressed = row.cells.any()
            m.d.sync += [
                cells.eq(row.cells),
                last.eq(row.last),
                closes.eq(row.last | ~pressed),
                walks.eq(in_band | pressed),
                in_band.eq(pressed & ~row.last),
                self._column.eq(0),
                self._y.eq(y_next),
                y_next.eq(Mux(row.last, 0, y_next + 1)),
            ]

    def _add_cells(self, m):
        """Each column's moments in the band so far, with the cell of this row; a clock behind the walk."""
        layout = moments_layout(self.derived)
        m.submodules.sums = sums = memory.Memory(shape=layout, depth=self.derived.skin.columns, init=[])
        read, write = sums.read_port(), sums.write_port()
        step, x = Signal.like(self._step), Signal.like(self._column)
        with m.If(self._enable):
            m.d.sync += [step.eq(self._step), x.eq(self._column)]
        for name, share in (("area", 1), ("sum_x", x), ("sum_y", self._y)):
            m.d.comb += write.data[name].eq(Mux(step.shadow, read.data[name], 0) + Mux(step.cell, share, 0))
        m.d.comb += [
            read.en.eq(self._enable),
            read.addr.eq(self._column),
            write.en.eq(self._enable & step.valid & step.cell),
            write.addr.eq(x),
        ]
        self._added, self._sum = Signal.like(step), Signal(layout)
        with m.If(self._enable):
            m.d.sync += [self._added.eq(step), self._sum.eq(write.data)]

    def _let_out(self, m):
        """In a band that closes the columns of a run are added up; a clock behind their own sums."""
        step, kept, zone = self._added, Signal.like(self._sum), Signal.like(self._sum)
        closes = step.valid & step.closes
        leaves = closes & (step.cell | step.shadow) & step.stop
        for name in ("area", "sum_x", "sum_y"):
            m.d.comb += zone[name].eq(kept[name] + self._sum[name])
        with m.If(self._enable):
            m.d.sync += kept.eq(Mux(closes & ~leaves, zone.as_value(), 0))
        m.d.comb += [
            self.records.valid.eq(leaves | step.end),
            self.records.payload.zone.eq(zone),
            self.records.payload.end.eq(step.end),
        ]
