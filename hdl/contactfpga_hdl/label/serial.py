"""Contact zones and their moments, one cell a clock, in little more than an adder and three memories.

Rows, clusters and brackets are those of ``docs/labelling.md``, walked a column at a time. A column takes one clock,
in which its cell is added to the group of the cluster being walked. Where a run of the row before begins, a second one
adds the moments that its zone brings in: from the table, or from a group that waits. Groups that wait lie in the table,
too, each at a place in its cluster and with the place of the one that began to wait before it.
"""

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import data, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga_hdl.label.steps import nesting, place_of
from contactfpga_hdl.payloads import moments_layout, record_layout, row_layout


class SerialLabeller(wiring.Component):
    """Rows in, zone records out; one cell a clock.

    A row of C columns takes C + e + 2 clocks, and a zone leaves a clock behind the last column of its last cluster
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
        self._declare()
        self._walk(m)
        self._cut(m)
        self._read_brackets(m)
        self._read_group(m)
        self._nest(m)
        self._know_runs(m)
        self._write_brackets(m)
        self._sum(m)
        self._let_out(m)
        return m

    def _declare(self):
        derived = self.derived
        columns = derived.skin.columns
        self._enable = Signal()
        # The walk: the new row and the one before move past. Between two rows an empty column is walked.
        self._cells = Signal(columns)
        self._before = Signal(columns + 1)
        self._last = Signal(init=1)
        self._walking = Signal()
        self._tail = Signal()  # the first clock behind the last column
        self._second = Signal()  # clock of this column
        self._advance = Signal()  # the last one
        self._column = Signal(max(1, (columns - 1).bit_length()))
        self._next_column = Signal.like(self._column)
        self._y = Signal(max(1, (derived.skin.rows - 1).bit_length()))
        # The column, and the one to the left, in the new row and in the row before.
        self._c, self._b = self._cells[0], self._before[0]
        self._c_left, self._b_left = Signal(), Signal()
        self._place = place_of(derived, self._column)[: (derived.open_zones - 1).bit_length()]
        self._begins = Signal()  # a run of the row before begins
        self._earlier, self._later = Signal(), Signal()  # and its zone has others in that row
        # What is done in this clock.
        self._closes = Signal()  # the cluster ends with the column to the left
        self._adds = Signal()  # the cell is added
        self._starts = Signal()  # and it is the first of its run
        self._joins = Signal()  # the run of the row before joins the group
        # The group of the cluster.
        self._whole = Signal(init=1)  # none of its zones has runs of the row before to come
        self._has_run = Signal()  # in the new row
        bits = len(self._place)
        self._first = Signal(bits)  # place of the first of them, or of the column to the left
        self._end = Signal(bits)  # place of the last one
        self._top = Signal(bits)  # of the groups that wait, the one to go on next
        self._group = Signal(moments_layout(derived))

    def _walk(self, m):
        row = self.rows.payload
        handed = self.rows.valid & ~self._walking & ~self._tail
        m.d.comb += [
            self.rows.ready.eq(self._enable & ~self._walking & ~self._tail),
            self._next_column.eq(Mux(self._walking, self._column + 1, 0)),
        ]
        with m.If(self._enable):
            m.d.sync += [self._tail.eq(0), self._second.eq(~self._advance)]
            with m.If(self._advance):
                m.d.sync += [self._c_left.eq(self._c), self._b_left.eq(self._b)]
            with m.If(Mux(self._walking, self._advance, handed)):
                m.d.sync += [
                    self._cells.eq(Mux(self._walking, self._cells >> 1, row.cells)),
                    self._before.eq(Cat(self._before[1:], self._c & ~self._last)),
                    self._column.eq(self._next_column),
                    self._walking.eq(~self._walking | (self._column != self.derived.skin.columns - 1)),
                    self._tail.eq(self._walking & (self._column == self.derived.skin.columns - 1)),
                ]
            with m.If(handed):
                m.d.sync += [self._last.eq(row.last), self._y.eq(Mux(self._last, 0, self._y + 1))]

    def _cut(self, m):
        """Where a cluster ends: with 8-connectivity at an empty column, else where neither row goes on."""
        inside = self._c_left | self._b_left
        m.d.comb += self._begins.eq(self._b & ~self._b_left)
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
            # A run of the row before whose zone the group has waited for goes on with the group.
            awaited = self._begins & self._earlier & ~self._whole
            m.d.comb += [
                self._closes.eq(ends & ~awaited & ~self._second),
                self._adds.eq(self._c & (self._second == ends)),
            ]
        m.d.comb += [
            self._advance.eq(self._second | ~two),
            self._starts.eq(self._adds & ~self._c_left),
            self._joins.eq(self._begins & self._second),
        ]

    def _read_brackets(self, m):
        derived = self.derived
        # With 8-connectivity a place is two columns'. It is read before a run of the new row can begin in either.
        odd = self._column[0] if derived.skin.connectivity == 8 else 1
        ports = []
        for name, bit in (("earlier", self._earlier), ("later", self._later)):
            m.submodules[name] = bits = memory.Memory(shape=1, depth=derived.open_zones, init=[])
            read = bits.read_port()
            m.d.comb += [
                read.en.eq(~self._walking | self._advance & odd),
                read.addr.eq(place_of(derived, self._next_column)),
                bit.eq(read.data),
            ]
            ports.append((read, bits.write_port()))
        (self._read_earlier, self._write_earlier), (self._read_later, self._write_later) = ports

    def _write_brackets(self, m):
        """A run has later ones until its zone is known to have none; it has earlier ones if its group has."""
        earlier, later = self._write_earlier, self._write_later
        m.d.comb += [
            earlier.en.eq(self._enable & (self._starts | self._found.has_run & self._has_run)),
            earlier.addr.eq(Mux(self._starts, self._place, self._first)),
            earlier.data.eq(self._has_run),
            later.en.eq(self._enable & (self._starts | self._closes & self._whole & self._has_run)),
            later.addr.eq(Mux(self._starts, self._place, self._end)),
            later.data.eq(self._starts),
        ]

    def _nest(self, m):
        depth = nesting(self.derived)
        if depth == 0:
            return
        # For each zone with runs of the row before passed and to come, the innermost first, whether its group has no
        # other one further out.
        outermost = Signal(depth)
        with m.If(self._enable):
            with m.If(self._closes):
                m.d.sync += self._whole.eq(1)
            with m.Elif(self._joins & self._later):
                m.d.sync += self._whole.eq(0)
            with m.Elif(self._joins & self._earlier):
                m.d.sync += self._whole.eq(outermost[0])
            with m.If(self._joins & (self._earlier ^ self._later)):
                m.d.sync += outermost.eq(Mux(self._later, Cat(self._whole, outermost), outermost >> 1))
            with m.If(self._closes & ~self._whole):
                m.d.sync += self._top.eq(self._first)
            with m.Elif(self._joins & self._earlier & self._whole):
                m.d.sync += self._top.eq(self._found.below)

    def _read_group(self, m):
        """The upper half of the memory stays zero: what is read there adds nothing."""
        bits = len(self._place)
        layout = data.StructLayout(
            {
                "moments": moments_layout(self.derived),
                "has_run": 1,
                "first": bits,
                "end": bits,
                "below": bits,
            }
        )
        m.submodules.groups = groups = memory.Memory(shape=layout, depth=2 << bits, init=[])
        self._read, self._write = groups.read_port(), groups.write_port()
        self._found = self._read.data
        self._wanted = Signal()
        m.d.comb += [
            self._wanted.eq(self._begins & ~self._second & (~self._earlier | self._whole)),
            self._read.addr.eq(Cat(Mux(self._earlier, self._top, self._place), ~self._wanted)),
        ]

    def _know_runs(self, m):
        with m.If(self._enable):
            with m.If(~self._has_run):
                m.d.sync += self._first.eq(self._place)
            with m.If(self._found.has_run):
                m.d.sync += self._first.eq(self._found.first)
            with m.If(self._starts):
                m.d.sync += self._end.eq(self._place)
            with m.Elif(~self._has_run):
                m.d.sync += self._end.eq(self._found.end)
            with m.If(self._starts | self._found.has_run):
                m.d.sync += self._has_run.eq(1)
            with m.If(self._closes | ~self._walking):
                m.d.sync += self._has_run.eq(0)

    def _sum(self, m):
        group = self._group
        cell = {"area": 1, "sum_x": self._column, "sum_y": self._y}
        with m.If(self._enable):
            for name, value in cell.items():
                more = self._found.moments[name] | Mux(self._adds, value, 0)
                m.d.sync += group[name].eq(group[name] + more)
        with m.If(self._enable & (self._closes | ~self._walking)):  # at power-up what the memory reads is not known
            m.d.sync += group.eq(0)
        m.d.comb += [
            self._write.en.eq(self._closes & (self._has_run | ~self._whole)),
            self._write.addr.eq(self._first),
            self._write.data.moments.eq(group),
            self._write.data.has_run.eq(self._has_run & ~self._whole),
            self._write.data.first.eq(self._first),
            self._write.data.end.eq(self._end),
            self._write.data.below.eq(self._top),
        ]

    def _let_out(self, m):
        mark = Signal()
        leaves = self._closes & self._whole & (~self._has_run | self._last)
        m.d.comb += [
            self.records.valid.eq(leaves | mark),
            self.records.payload.zone.eq(self._group),
            self.records.payload.end.eq(mark),
            self._enable.eq(~self.records.valid | self.records.ready),
        ]
        with m.If(self._enable):
            m.d.sync += mark.eq(self._tail & self._last)
