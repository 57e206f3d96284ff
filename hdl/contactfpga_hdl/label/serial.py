"""Contact zones and their moments, one cell a clock, in little more than an adder and two memories.

Rows, clusters and brackets are those of ``docs/labelling.md``, walked a column at a time. A column takes one clock,
in which its cell is added to the group of the cluster being walked. Where a run of the row before begins, a second one
adds the moments that its zone brings in: from the table, or from the groups that wait. Both lie in one memory.
"""

from amaranth.hdl import Cat, Const, Module, Mux, Signal
from amaranth.lib import data, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.derived import Derived
from contactfpga.skin import Skin
from contactfpga_hdl.label.steps import nesting, place_of
from contactfpga_hdl.payloads import moments_layout, record_layout, row_layout


class SerialLabeller(wiring.Component):
    """Rows in, zone records out; one cell a clock.

    A row of C columns takes C + e + 2 clocks, a zone leaves a clock behind the last column of its last cluster
    (docs/timing.md). e is the number of runs in the row before, so at most ceil(C/2), with 8-connectivity; with 4 it
    is at most C.
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
        derived = self.derived
        self._place_bits = (derived.open_zones - 1).bit_length()
        self._declare()
        self._walk(m)
        self._cut(m)
        self._read_tokens(m)
        self._nest(m)
        self._find_place(m)
        self._write_tokens(m)
        self._sum(m)
        self._let_out(m)
        return m

    def _declare(self):
        derived = self.derived
        columns = derived.skin.columns
        # The walk: a row and the one before it move past, a column at a time.
        self._cells = Signal(columns)
        self._before = Signal(columns)
        self._last = Signal()
        self._busy = Signal()
        self._tail = Signal()  # behind the last column
        self._second = Signal()  # clock of this column
        self._column = Signal(max(1, (columns - 1).bit_length()))
        self._y = Signal(max(1, (derived.skin.rows - 1).bit_length()))
        self._enable = Signal()
        self._advance = Signal()
        # What the column is.
        self._c, self._b = Signal(), Signal()  # new row, row before; and the same of the column before
        self._c_left, self._b_left = Signal(), Signal()
        self._begins = Signal()  # a run of the row before begins
        self._closes = Signal()  # the cluster has ended with the column before; in the first clock
        self._adds = Signal()  # its cell is added in this clock
        self._starts = Signal()  # it is the first of its run
        self._joins = Signal()  # in this clock the run of the row before joins
        self._earlier, self._later = Signal(), Signal()  # has its zone other runs in that row?
        # The group of the cluster.
        self._whole = Signal(init=1)  # no zone of it has runs of the row before to come
        self._has_run = Signal()  # in the new row, and then the places of the first and the last one
        self._first = Signal(self._place_bits)
        self._end = Signal(self._place_bits)

    def _walk(self, m):
        columns = self.derived.skin.columns
        row = self.rows.payload
        y_next = Signal.like(self._y)
        m.d.comb += [
            self.rows.ready.eq(self._enable & ~self._busy),
            self._c.eq(self._cells[0]),
            self._b.eq(self._before[0] & self._busy & ~self._tail),
            self._begins.eq(self._b & ~self._b_left),
        ]
        with m.If(self._enable):
            with m.If(~self._busy):
                m.d.sync += self._last.eq(0)  # its end mark is on its way
                with m.If(self.rows.valid):
                    m.d.sync += [
                        self._cells.eq(row.cells),
                        self._busy.eq(1),
                        self._last.eq(row.last),
                        self._y.eq(y_next),
                        y_next.eq(Mux(row.last, 0, y_next + 1)),
                    ]
            with m.Elif(self._advance):
                m.d.sync += [
                    self._second.eq(0),
                    self._cells.eq(self._cells >> 1),
                    self._c_left.eq(self._c),
                    self._b_left.eq(self._b),
                ]
                with m.If(self._tail):
                    m.d.sync += [self._tail.eq(0), self._busy.eq(0), self._column.eq(0)]
                with m.Else():
                    m.d.sync += [
                        self._before.eq(Cat(self._before[1:], self._c & ~self._last)),
                        self._tail.eq(self._column == columns - 1),
                        self._column.eq(self._column + 1),
                    ]
            with m.Else():
                m.d.sync += self._second.eq(1)

    def _cut(self, m):
        inside = self._c_left | self._b_left
        if self.derived.skin.connectivity == 8:
            two = self._begins
            m.d.comb += [
                self._closes.eq(inside & ~(self._c | self._b)),
                self._adds.eq(self._c & ~self._second),
            ]
        else:
            ends = Signal()
            m.d.comb += ends.eq(inside & ~(self._c & self._c_left | self._b & self._b_left))
            two = self._begins | ends & self._c
            # A run of the row before that is known to be of the group's zone needs no cluster of its own.
            same = self._begins & self._earlier & ~self._whole
            m.d.comb += [
                self._closes.eq(ends & ~same & ~self._second),
                self._adds.eq(self._c & (self._second ^ ~ends)),
            ]
        m.d.comb += [
            self._advance.eq(self._second | ~two),
            self._starts.eq(self._adds & ~self._c_left),
            self._joins.eq(self._second & self._begins),
        ]

    def _read_tokens(self, m):
        """Whether a run of the same zone comes earlier, or later, in the row of the run of the row before."""
        derived = self.derived
        next_column = Signal.like(self._column)
        m.d.comb += next_column.eq(Mux(self._busy, self._column + 1, 0))
        if derived.skin.connectivity == 8:
            # A place is two columns'; it is read before a run of the new row can begin in the first of them.
            read = ~self._busy | self._advance & self._column[0]
        else:
            read = ~self._busy | self._advance
        for name, token in (("earlier", self._earlier), ("later", self._later)):
            m.submodules[name] = words = memory.Memory(shape=1, depth=derived.open_zones, init=[])
            port = words.read_port()
            m.d.comb += [port.en.eq(read), port.addr.eq(place_of(derived, next_column)), token.eq(port.data)]
            setattr(self, f"_{name}_write", words.write_port())

    def _nest(self, m):
        depth = nesting(self.derived)
        outer = Signal(depth)  # of the zones with runs of the row before to come, the innermost first: the outermost
        # of its group
        self._level = Signal(range(depth + 1))  # groups that wait
        self._pops = Signal()
        self._pushes = Signal()
        m.d.comb += [
            self._pops.eq(self._begins & self._earlier & self._whole),
            self._pushes.eq(self._closes & ~self._whole),
        ]
        if depth == 0:
            return
        with m.If(self._enable):
            with m.If(self._closes):
                m.d.sync += [self._whole.eq(1), self._level.eq(self._level + ~self._whole)]
            with m.If(self._joins):
                with m.If(self._later):
                    m.d.sync += self._whole.eq(0)
                    with m.If(~self._earlier):
                        m.d.sync += outer.eq(Cat(self._whole, outer)[:depth])
                with m.Elif(self._earlier):
                    m.d.sync += [self._whole.eq(outer[0]), outer.eq(outer >> 1)]
                with m.If(self._pops):
                    m.d.sync += self._level.eq(self._level - 1)

    def _find_place(self, m):
        """The memory: zones of the row before or the new one, then groups that wait, and one word that stays zero."""
        derived = self.derived
        layout = data.StructLayout(
            {
                "moments": moments_layout(derived),
                "has_run": 1,
                "first": self._place_bits,
                "end": self._place_bits,
            }
        )
        bits = self._place_bits
        m.submodules.groups = groups = memory.Memory(shape=layout, depth=2 << bits, init=[])
        read, self._write = groups.read_port(), groups.write_port()
        self._found = read.data
        self._place = Signal(bits)
        nothing = Const(-1, bits + 1)
        top = Signal(bits)
        m.d.comb += [self._place.eq(place_of(derived, self._column)), top.eq(self._level - 1)]
        m.d.comb += read.addr.eq(nothing)
        with m.If(self._begins & ~self._second):
            with m.If(~self._earlier):
                m.d.comb += read.addr.eq(Cat(self._place, Const(0, 1)))
            with m.Elif(self._whole):
                m.d.comb += read.addr.eq(Cat(top, Const(1, 1)))
        with m.If(self._enable):
            with m.If(self._starts):
                m.d.sync += self._end.eq(self._place)
                with m.If(~self._has_run):
                    m.d.sync += self._first.eq(self._place)
                m.d.sync += self._has_run.eq(1)
            with m.If(self._found.has_run):
                m.d.sync += self._first.eq(self._found.first)
                with m.If(~self._has_run):
                    m.d.sync += self._end.eq(self._found.end)
                m.d.sync += self._has_run.eq(1)
            with m.If(self._closes):
                m.d.sync += self._has_run.eq(0)

    def _write_tokens(self, m):
        earlier, later = self._earlier_write, self._later_write
        stores = self._closes & self._whole & self._has_run
        m.d.comb += [
            earlier.en.eq(self._enable & (self._starts | self._found.has_run & self._has_run)),
            earlier.addr.eq(Mux(self._starts, self._place, self._first)),
            earlier.data.eq(self._has_run),
            later.en.eq(self._enable & (self._starts | stores)),
            later.addr.eq(Mux(self._starts, self._place, self._end)),
            later.data.eq(self._starts),
        ]

    def _sum(self, m):
        moments = moments_layout(self.derived)
        group = Signal(moments)
        self._group = group
        cell = {"area": 1, "sum_x": self._column, "sum_y": self._y}
        with m.If(self._enable):
            for name, value in cell.items():
                more = self._found.moments[name] | Mux(self._adds, value, 0)
                m.d.sync += group[name].eq(group[name] + more)
            with m.If(self._closes):
                m.d.sync += group.eq(0)
        bits = self._place_bits
        m.d.comb += [
            self._write.en.eq(self._closes & (self._has_run | ~self._whole)),
            self._write.addr.eq(
                Cat(Mux(self._pushes, self._level, self._first)[:bits], self._pushes) if bits else self._pushes
            ),
            self._write.data.moments.eq(group),
            self._write.data.has_run.eq(self._has_run & self._pushes),
            self._write.data.first.eq(self._first),
            self._write.data.end.eq(self._end),
        ]

    def _let_out(self, m):
        leaves = self._closes & self._whole & (~self._has_run | self._last)
        mark = ~self._busy & self._last
        m.d.comb += [
            self.records.valid.eq(leaves | mark),
            self.records.payload.zone.eq(self._group),
            self.records.payload.end.eq(mark),
            self._enable.eq(~self.records.valid | self.records.ready),
        ]
