"""Contact zones and their moments, in one pass over the rows as they arrive.

Two adjacent rows are looked at together. The connected pieces of these two rows alone, *clusters*, are walked from
left to right, one run of each row a clock. What the zones of the row before look like further up is known from two
bits a run: whether a run of the same zone comes before it in its row, and whether one comes after. Zones never
cross in the plane, so these bits nest like brackets, and a stack replaces equivalence tables: a zone that has more
runs to the right waits on the stack, and the innermost one is always the next that is needed.

A zone's moments lie in a table at the start column of its last run in the row (halved with 8-connectivity). Two
runs of different zones in the same row, or in two adjacent rows, never share such a place, so the table
cannot overflow and needs no allocation.
"""

import math

from amaranth.hdl import Array, Cat, Const, Module, Mux, Signal
from amaranth.lib import data, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.derived import Derived
from contactfpga.skin import Skin
from contactfpga_hdl.payloads import moments_layout, record_layout, row_layout
from contactfpga_hdl.stack import Stack


def _step_layout(derived: Derived) -> data.StructLayout:
    """One step of the walk: at most one run of the row before and one of the new row, of one cluster."""
    column = max(1, (derived.skin.columns - 1).bit_length())
    return data.StructLayout(
        {
            "end": 1,  # no step: the mark behind a frame
            "has_before": 1,
            "before": column,  # start of the run in the row before
            "has_run": 1,
            "start": column,  # first and last column of the new run
            "stop": column,
            "opens": 1,  # first and last step of a cluster
            "closes": 1,
            "row_done": 1,  # last step of a row
            "y": max(1, (derived.skin.rows - 1).bit_length()),
            "final": 1,  # no row follows in this frame
        }
    )


def _lowest(bits):
    """The lowest bit that is set, alone."""
    return (bits & -bits)[: len(bits)]


def _without_lowest(bits):
    return (bits & (bits - 1))[: len(bits)]


def _index(one_hot, width):
    """Number of the bit that is set."""
    return Cat(
        Cat(one_hot[i] for i in range(len(one_hot)) if i >> bit & 1).any() if len(one_hot) > 1 else Const(0, 1)
        for bit in range(width)
    )


class RunLabeller(wiring.Component):
    """Rows in, zone records out; work follows the runs of pressed cells.

    A row with n steps takes ``max(1, n)`` clocks, the last one of a frame one more; a zone leaves two clocks after
    the last step in which it has a cell (docs/timing.md). With C columns a row takes at most ceil(C/2) steps with
    8-connectivity and C with 4.
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
        m.submodules.walk = walk = _Walk(self.derived)
        m.submodules.merge = merge = _Merge(self.derived)
        wiring.connect(m, wiring.flipped(self.rows), walk.rows)
        wiring.connect(m, merge.records, wiring.flipped(self.records))
        m.d.comb += [
            walk.enable.eq(merge.ready),
            merge.valid.eq(walk.step_valid),
            merge.step.eq(walk.step),
            merge.lookup.eq(walk.lookup),
        ]
        return m


class _Walk(wiring.Component):
    """Cuts two adjacent rows into steps, one a clock while ``enable`` is high.

    ``step`` is registered; ``lookup`` is the start of its run in the row before, one clock earlier.
    """

    def __init__(self, derived: Derived):
        self.derived = derived
        step = _step_layout(derived)
        super().__init__(
            {
                "rows": In(stream.Signature(row_layout(derived))),
                "enable": In(1),
                "step_valid": Out(1),
                "step": Out(step),
                "lookup": Out(step["before"].shape),
            }
        )

    def elaborate(self, platform):
        m = Module()
        columns = self.derived.skin.columns
        # Columns still to be walked: where runs start and stop, and where clusters end.
        self._befores = Signal(columns)
        self._starts = Signal(columns)
        self._stops = Signal(columns)
        self._ends = Signal(columns)
        self._last = Signal()
        self._done = Signal()  # the row's last cluster ends in this step
        self._y = Signal(self.step.y.shape())
        self._walk_clusters(m)
        self._take_row(m)
        return m

    def _walk_clusters(self, m):
        work = self._ends.any()
        inside = Signal.like(self._ends)  # columns up to the end of the first cluster
        befores_left = _without_lowest(self._befores)
        starts_left = _without_lowest(self._starts)
        ends_left = _without_lowest(self._ends)
        has_before = (self._befores & inside).any()
        has_run = (self._starts & inside).any()
        closes = Signal()
        opens = Signal(init=1)
        step = Signal.like(self.step)
        m.d.comb += [
            inside.eq(self._ends ^ (self._ends - 1)),
            closes.eq(~(befores_left & inside).any() & ~(starts_left & inside).any()),
            self._done.eq(closes & ~ends_left.any()),
            step.end.eq(~work),
            step.has_before.eq(has_before),
            step.before.eq(_index(_lowest(self._befores), len(step.before))),
            step.has_run.eq(has_run),
            step.start.eq(_index(_lowest(self._starts), len(step.start))),
            step.stop.eq(_index(_lowest(self._stops), len(step.stop))),
            step.opens.eq(opens),
            step.closes.eq(closes),
            step.row_done.eq(self._done),
            step.y.eq(self._y),
            step.final.eq(self._last),
            self.lookup.eq(step.before),
        ]
        with m.If(self.enable):
            m.d.sync += [self.step.eq(step), self.step_valid.eq(work | self._last)]
        with m.If(self.enable & work):
            m.d.sync += opens.eq(closes)
            with m.If(has_before):
                m.d.sync += self._befores.eq(befores_left)
            with m.If(has_run):
                m.d.sync += [self._starts.eq(starts_left), self._stops.eq(_without_lowest(self._stops))]
            with m.If(closes):
                m.d.sync += self._ends.eq(ends_left)

    def _take_row(self, m):
        row = self.rows.payload
        before = Signal.like(row.cells)  # the row last taken, empty before a frame
        y_next = Signal.like(self._y)
        work = self._ends.any()
        with m.If(self.enable & ~work):
            m.d.sync += self._last.eq(0)  # its end mark is on its way
        m.d.comb += self.rows.ready.eq(self.enable & (~work | self._done & ~self._last))
        with m.If(self.rows.valid & self.rows.ready):
            right_row, right_before = row.cells >> 1, before >> 1
            if self.derived.skin.connectivity == 8:
                joined = (row.cells | before) & (right_row | right_before)
            else:
                joined = row.cells & right_row | before & right_before
            m.d.sync += [
                self._befores.eq(before & ~(before << 1)),
                self._starts.eq(row.cells & ~(row.cells << 1)),
                self._stops.eq(row.cells & ~right_row),
                self._ends.eq((row.cells | before) & ~joined),
                self._last.eq(row.last),
                self._y.eq(y_next),
                before.eq(Mux(row.last, 0, row.cells)),
                y_next.eq(Mux(row.last, 0, y_next + 1)),
            ]


class _Merge(wiring.Component):
    """Joins the steps' runs into zones and lets a zone out when it is closed. Takes a step while ``ready``."""

    def __init__(self, derived: Derived):
        self.derived = derived
        step = _step_layout(derived)
        super().__init__(
            {
                "valid": In(1),
                "step": In(step),
                "lookup": In(step["before"].shape),
                "ready": Out(1),
                "records": Out(stream.Signature(record_layout(derived))),
            }
        )
        moments = moments_layout(derived)
        nesting = math.ceil(derived.skin.columns / 2) // 2  # zones with a run passed and a run to come
        self._nesting = nesting
        self._group_layout = data.StructLayout(
            {
                "open": range(nesting + 1),  # zones of the row before with runs to come
                "has_run": 1,  # in the new row, and then where its first and last one start
                "first": step["start"].shape,
                "last": step["start"].shape,
                "sums": moments,
            }
        )

    def elaborate(self, platform):
        m = Module()
        m.submodules.stack = stack = Stack(self._group_layout, self._nesting)
        self._brackets(m)
        kept = Signal(self._group_layout)  # the group of the cluster being walked
        current = Signal(self._group_layout)
        with m.If(~self.step.opens):
            m.d.comb += current.eq(kept)
        joined, pop = self._join_waiting(m, current, stack)
        group = self._add_runs(m, joined, current, pop, stack)
        closed = self.step.closes & (group.open == 0)
        active = self.valid & ~self.step.end
        m.d.comb += [
            self.ready.eq(~self.records.valid | self.records.ready),
            stack.enable.eq(self.ready & active),
            stack.pop.eq(pop),
            stack.push.eq(self.step.closes & (group.open != 0)),
            stack.entry.eq(group),
            self._table_write.en.eq(self.ready & active & closed & group.has_run),
            self._table_write.addr.eq(self._place(group.last)),
            self._table_write.data.eq(group.sums),
        ]
        leaves = self.step.end | closed & (self.step.final | ~group.has_run)
        with m.If(self.ready):
            m.d.sync += self.records.valid.eq(self.valid & leaves)
        with m.If(self.ready & self.valid):
            m.d.sync += [
                kept.eq(group),
                self.records.payload.zone.eq(Mux(self.step.end, 0, group.sums)),
                self.records.payload.end.eq(self.step.end),
            ]
        return m

    def _place(self, column):
        """Where a run that starts at ``column`` keeps its zone's moments."""
        return column >> 1 if self.derived.skin.connectivity == 8 else column

    def _brackets(self, m):
        """For each run of either row: does a run of the same zone come before it, or after it, in its row?"""
        slots = math.ceil(self.derived.skin.columns / 2)
        self._after_one = Signal(slots)  # of the new row, as known so far
        self._before_one = Signal(slots)
        self._new_after_one = Signal(slots)
        self._new_before_one = Signal(slots)
        old_after_one = Signal(slots)
        old_before_one = Signal(slots)
        self._earlier = old_after_one.bit_select(self.step.before >> 1, 1)
        self._later = old_before_one.bit_select(self.step.before >> 1, 1)
        with m.If(self.ready & self.valid & ~self.step.end):
            m.d.sync += [self._after_one.eq(self._new_after_one), self._before_one.eq(self._new_before_one)]
            with m.If(self.step.row_done):
                m.d.sync += [
                    old_after_one.eq(self._new_after_one),
                    old_before_one.eq(self._new_before_one),
                    self._after_one.eq(0),
                    self._before_one.eq(0),
                ]

    def _join_waiting(self, m, current, stack):
        """Join the group on top of the stack if the run before continues it."""
        pop = Signal()
        joined = Signal(self._group_layout)
        m.d.comb += [
            pop.eq(self.step.has_before & self._earlier & (current.open == 0)),
            joined.eq(current),
        ]
        with m.If(pop):
            m.d.comb += [
                joined.open.eq(stack.top.open),
                joined.has_run.eq(stack.top.has_run | current.has_run),
                joined.first.eq(Mux(stack.top.has_run, stack.top.first, current.first)),
                joined.last.eq(Mux(current.has_run, current.last, stack.top.last)),
            ]
        return joined, pop

    def _add_runs(self, m, joined, current, pop, stack):
        """Add the step's runs to the joined group, and note which runs of the new row are now of one zone."""
        step = self.step
        group = Signal(self._group_layout)
        passed = step.has_before & ~self._later  # the zone's last run: its moments come in
        m.d.comb += [
            group.eq(joined),
            group.open.eq(joined.open + (step.has_before & ~self._earlier & self._later) - (passed & self._earlier)),
        ]
        with m.If(step.has_run):
            m.d.comb += [
                group.has_run.eq(1),
                group.first.eq(Mux(joined.has_run, joined.first, step.start)),
                group.last.eq(step.start),
            ]
        run = self._run_moments(m)
        table = self._read_table(m)
        for name in ("area", "sum_x", "sum_y"):
            m.d.comb += group.sums[name].eq(
                current.sums[name]
                + Mux(pop, stack.top.sums[name], 0)
                + Mux(passed, table[name], 0)
                + Mux(step.has_run, run[name], 0)
            )
        over = pop & stack.top.has_run & current.has_run  # two groups of runs become one
        onto = step.has_run & joined.has_run  # the new run follows one of its zone

        def mark(condition, column):
            return Mux(condition, 1 << (column >> 1), 0)

        m.d.comb += [
            self._new_before_one.eq(self._before_one | mark(over, stack.top.last) | mark(onto, joined.last)),
            self._new_after_one.eq(self._after_one | mark(over, current.first) | mark(onto, step.start)),
        ]
        return group

    def _run_moments(self, m):
        """Moments of the new run; the columns' sum is a difference of triangular numbers."""
        step = self.step
        run = Signal(moments_layout(self.derived))
        columns = self.derived.skin.columns
        up_to = Array(math.comb(column + 1, 2) for column in range(columns))
        below = Array(math.comb(column, 2) for column in range(columns))
        m.d.comb += [
            run.area.eq(step.stop - step.start + 1),
            run.sum_x.eq(up_to[step.stop] - below[step.start]),
            run.sum_y.eq(run.area[: columns.bit_length()] * step.y),
        ]
        return run

    def _read_table(self, m):
        shape = moments_layout(self.derived)
        m.submodules.table = table = memory.Memory(shape=shape, depth=self.derived.open_zones, init=[])
        self._table_write = table.write_port()
        read = table.read_port(transparent_for=(self._table_write,))
        m.d.comb += [read.en.eq(self.ready), read.addr.eq(self._place(self.lookup))]
        return read.data
