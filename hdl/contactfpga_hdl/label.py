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


def _join_layout(derived: Derived) -> data.StructLayout:
    """What a step adds to its zone, and what becomes of it."""
    return data.StructLayout(
        {
            "end": 1,
            "opens": 1,  # start from nothing
            "run": moments_layout(derived),  # add the new run, a group from the stack, and a zone of the row before
            "pop": 1,
            "load": 1,
            "push": 1,  # put what there is on the stack, or into the table, or let it out
            "store": 1,
            "place": range(derived.open_zones),
            "leaves": 1,
        }
    )


def _nesting(derived: Derived) -> int:
    """The most zones with a run passed and a run to come."""
    return math.ceil(derived.skin.columns / 2) // 2


def _place(derived: Derived, column):
    """Where a run that starts at ``column`` keeps its zone's moments."""
    return column >> 1 if derived.skin.connectivity == 8 else column


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
    8-connectivity and C with 4. Each step passes walk, join and sum in three clocks.
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
        m.submodules.join = join = _Join(self.derived)
        m.submodules.sum = sums = _Sum(self.derived)
        wiring.connect(m, wiring.flipped(self.rows), walk.rows)
        wiring.connect(m, sums.records, wiring.flipped(self.records))
        for stage in (walk, join, sums):
            m.d.comb += stage.enable.eq(~self.records.valid | self.records.ready)
        m.d.comb += [
            join.valid.eq(walk.step_valid),
            join.step.eq(walk.step),
            sums.valid.eq(join.join_valid),
            sums.join.eq(join.join),
            sums.lookup.eq(walk.step.before),
        ]
        return m


class _Walk(wiring.Component):
    """Cuts two adjacent rows into steps, one a clock while ``enable`` is high."""

    def __init__(self, derived: Derived):
        self.derived = derived
        step = _step_layout(derived)
        super().__init__(
            {
                "rows": In(stream.Signature(row_layout(derived))),
                "enable": In(1),
                "step_valid": Out(1),
                "step": Out(step),
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


class _Join(wiring.Component):
    """Which runs of the new row are of one zone, and what each step adds to which zone."""

    def __init__(self, derived: Derived):
        self.derived = derived
        step = _step_layout(derived)
        super().__init__(
            {
                "enable": In(1),
                "valid": In(1),
                "step": In(step),
                "join_valid": Out(1),
                "join": Out(_join_layout(derived)),
            }
        )
        self._runs = max(1, math.ceil(derived.skin.columns / 2))  # the most a row can hold
        self._group_layout = data.StructLayout(
            {
                "open": range(_nesting(derived) + 1),  # zones of the row before with runs to come
                "has_run": 1,  # in the new row, and then the numbers of the first and the last one
                "first": range(self._runs),
                "last": range(self._runs),
                "place": range(derived.open_zones),  # of the last one in the table
            }
        )

    def elaborate(self, platform):
        m = Module()
        m.submodules.stack = stack = Stack(self._group_layout, _nesting(self.derived))
        self._works = self.enable & self.valid & ~self.step.end
        kept = Signal(self._group_layout)  # the group of the cluster being walked
        current = Signal(self._group_layout)
        with m.If(~self.step.opens):
            m.d.comb += current.eq(kept)
        earlier, later = self._brackets(m)
        pop = self.step.has_before & earlier & (current.open == 0)
        passed = self.step.has_before & ~later  # the last run of its zone
        joined = self._take_in(m, current, pop, stack.top)
        group = self._add_run(m, joined)
        m.d.comb += [
            group.open.eq(joined.open + (self.step.has_before & ~earlier & later) - (passed & earlier)),
            stack.enable.eq(self._works),
            stack.pop.eq(pop),
            stack.push.eq(self.step.closes & (group.open != 0)),
            stack.entry.eq(group),
        ]
        self._mark(m, current, pop, stack.top, joined)
        with m.If(self._works):
            m.d.sync += kept.eq(group)
        with m.If(self.enable):
            m.d.sync += [self.join_valid.eq(self.valid), self.join.eq(self._decide(m, group, pop, passed))]
        return m

    def _brackets(self, m):
        """Does a run of the same zone come earlier, or later, in the row of the step's run of the row before?

        Bit i belongs to the row's i-th run; those of the row before move down as its runs are passed.
        """
        old_after, old_before = Signal(self._runs), Signal(self._runs)  # runs after one, before one, of the same zone
        self._after, self._before = Signal(self._runs), Signal(self._runs)  # the same in the new row, as known so far
        self._new_after, self._new_before = Signal(self._runs), Signal(self._runs)
        self._number = Signal(range(self._runs))  # of the step's new run
        with m.If(self._works):
            m.d.sync += [
                self._after.eq(self._new_after),
                self._before.eq(self._new_before),
                self._number.eq(self._number + self.step.has_run),
            ]
            with m.If(self.step.has_before):
                m.d.sync += [old_after.eq(old_after >> 1), old_before.eq(old_before >> 1)]
            with m.If(self.step.row_done):
                m.d.sync += [
                    old_after.eq(self._new_after),
                    old_before.eq(self._new_before),
                    self._after.eq(0),
                    self._before.eq(0),
                    self._number.eq(0),
                ]
        return old_after[0], old_before[0]

    def _take_in(self, m, current, pop, waiting):
        """The current group, with the group that waited on the stack if the run before continues it."""
        joined = Signal(self._group_layout)
        m.d.comb += joined.eq(current)
        with m.If(pop):
            m.d.comb += [
                joined.open.eq(waiting.open),
                joined.has_run.eq(waiting.has_run | current.has_run),
                joined.first.eq(Mux(waiting.has_run, waiting.first, current.first)),
                joined.last.eq(Mux(current.has_run, current.last, waiting.last)),
                joined.place.eq(Mux(current.has_run, current.place, waiting.place)),
            ]
        return joined

    def _add_run(self, m, joined):
        group = Signal(self._group_layout)
        m.d.comb += group.eq(joined)
        with m.If(self.step.has_run):
            m.d.comb += [
                group.has_run.eq(1),
                group.first.eq(Mux(joined.has_run, joined.first, self._number)),
                group.last.eq(self._number),
                group.place.eq(_place(self.derived, self.step.start)),
            ]
        return group

    def _mark(self, m, current, pop, waiting, joined):
        """Set the brackets of runs of the new row that are now known to be of one zone."""
        over = pop & waiting.has_run & current.has_run  # two groups of runs become one
        onto = self.step.has_run & joined.has_run  # the new run follows one of its zone

        def bit(condition, number):
            return Mux(condition, 1 << number, 0)

        m.d.comb += [
            self._new_before.eq(self._before | bit(over, waiting.last) | bit(onto, joined.last)),
            self._new_after.eq(self._after | bit(over, current.first) | bit(onto, self._number)),
        ]

    def _decide(self, m, group, pop, passed):
        step = self.step
        closed = step.closes & (group.open == 0)
        join = Signal(self.join.shape())
        m.d.comb += [
            join.end.eq(step.end),
            join.opens.eq(step.opens),
            join.pop.eq(pop),
            join.load.eq(passed),
            join.push.eq(step.closes & (group.open != 0)),
            join.store.eq(closed & group.has_run),
            join.leaves.eq(step.end | closed & (step.final | ~group.has_run)),
            join.place.eq(group.place),
        ]
        with m.If(step.has_run):
            m.d.comb += self._run_moments(m, join.run)
        return join

    def _run_moments(self, m, run):
        """Moments of the new run; the columns' sum is a difference of triangular numbers."""
        start, stop = self.step.start, self.step.stop
        columns = self.derived.skin.columns
        up_to = Array(math.comb(column + 1, 2) for column in range(columns))
        below = Array(math.comb(column, 2) for column in range(columns))
        length = Signal(range(columns + 1))
        m.d.comb += length.eq(stop - start + 1)
        return [
            run.area.eq(length),
            run.sum_x.eq(up_to[stop] - below[start]),
            run.sum_y.eq(length * self.step.y),
        ]


class _Sum(wiring.Component):
    """Adds up the moments of each zone. ``lookup`` is the start of the run before, one clock ahead of ``join``."""

    def __init__(self, derived: Derived):
        self.derived = derived
        super().__init__(
            {
                "enable": In(1),
                "valid": In(1),
                "join": In(_join_layout(derived)),
                "lookup": In(_step_layout(derived)["before"].shape),
                "records": Out(stream.Signature(record_layout(derived))),
            }
        )

    def elaborate(self, platform):
        m = Module()
        moments = moments_layout(self.derived)
        join = self.join
        works = self.enable & self.valid & ~join.end
        m.submodules.stack = stack = Stack(moments, _nesting(self.derived))
        m.submodules.table = table = memory.Memory(shape=moments, depth=self.derived.open_zones, init=[])
        write = table.write_port()
        read = table.read_port()
        kept = Signal(moments)
        just_stored = Signal()  # what is to be loaded is what the step before put into the table
        group = Signal(moments)
        loaded = Mux(just_stored, kept.as_value(), read.data.as_value())
        loaded = data.View(moments, Mux(join.load, loaded, 0))
        for name in ("area", "sum_x", "sum_y"):
            m.d.comb += group[name].eq(
                (Mux(join.opens, 0, kept[name]) + join.run[name]) + (Mux(join.pop, stack.top[name], 0) + loaded[name])
            )
        with m.If(works):
            m.d.sync += kept.eq(group)
        with m.If(self.enable):
            m.d.sync += just_stored.eq(write.en & (write.addr == read.addr))
        m.d.comb += [
            stack.enable.eq(works),
            stack.pop.eq(join.pop),
            stack.push.eq(join.push),
            stack.entry.eq(group),
            read.en.eq(self.enable),
            read.addr.eq(_place(self.derived, self.lookup)),
            write.en.eq(works & join.store),
            write.addr.eq(join.place),
            write.data.eq(group),
            self.records.valid.eq(self.valid & join.leaves),
            self.records.payload.zone.eq(Mux(join.end, 0, group)),
            self.records.payload.end.eq(join.end),
        ]
        return m
