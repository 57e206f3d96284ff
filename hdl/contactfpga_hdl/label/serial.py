"""Contact zones and their moments, one cell per clock, in little more than an adder and three memories.

Rows, clusters and brackets are those of docs/labelling.md. Each column takes a clock, in which its cell is added to the
walked cluster's group. At the start of a run of the row before, a second clock adds its zone's moments, from the table
or from a waiting group. Waiting groups are in the table, too, each linked to the group that began to wait before.
"""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import data, memory, wiring

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga_hdl.label.around import SerialTurns, stored_turns
from contactfpga_hdl.label.steps import kept_layout, nesting, place_of, zone_of
from contactfpga_hdl.payloads import labeller_ports


class _Columns:
    """Shifts the new row and the one before, a column at a time; between two rows an empty column is walked."""

    def __init__(self, derived: Derived):
        columns = derived.skin.columns
        self.active = Signal()
        self.cells = Signal(columns)  # of the new row from this column on
        self.before = Signal(columns + 1)  # of the row before
        self.last = Signal(init=1)  # no row follows in this frame
        self.tail = Signal()  # the first clock after the last column
        self.second = Signal()  # clock of this column
        self.column = Signal(max(1, (columns - 1).bit_length()))
        self.next_column = Signal.like(self.column)
        self.y = Signal(max(1, (derived.skin.rows - 1).bit_length()))
        self.cell_left = Signal()  # of the column to the left
        self.before_left = Signal()
        self.place = place_of(derived, self.column)[: (derived.open_zones - 1).bit_length()]

    @property
    def cell(self) -> Value:
        return self.cells[0]

    @property
    def cell_before(self) -> Value:
        return self.before[0]


class _Step:
    def __init__(self) -> None:
        self.enable = Signal()  # anything at all: no record waits
        self.advance = Signal()  # it is the last one of the column
        self.begins = Signal()  # a run of the row before begins
        self.closes = Signal()  # the cluster ends with the column to the left
        self.adds = Signal()  # the cell is added
        self.starts = Signal()  # and it is the first of its run
        self.joins = Signal()  # the run of the row before joins the group
        self.apart = Signal()  # and does not touch the column to the left


class _Group:
    def __init__(self, derived: Derived, place_bits: int):
        self.whole = Signal(init=1)  # none of its zones has runs of the row before to come
        self.has_run = Signal()  # in the new row
        self.first = Signal(place_bits)  # place of the first of them, or of the column to the left
        self.end = Signal(place_bits)  # place of the last one
        self.innermost = Signal(place_bits)  # of the groups that wait, the one to go on next
        self.moments = Signal(kept_layout(derived))


def _stored_layout(derived: Derived, place_bits: int) -> data.StructLayout:
    places = {"first": place_bits, "end": place_bits, "below": place_bits}
    turns = stored_turns() if derived.skin.closed else {}
    return data.StructLayout({"moments": kept_layout(derived), "has_run": 1, **places, **turns})


class SerialLabeller(wiring.Component):
    """Rows in, zone records out, one cell per clock; ports as in :func:`~contactfpga_hdl.payloads.labeller_ports`.

    A row of C columns takes C + e + 2 clocks, and a zone leaves a clock after the last column of its last cluster
    (docs/timing.md). e is the number of runs in the row before, at most ceil(C/2) with 8-connectivity, C with 4. A row
    that is joined over the seam takes two clocks more.
    """

    def __init__(self, skin: Skin):
        self.derived = skin.derived
        super().__init__(labeller_ports(self.derived))

    def elaborate(self, platform):
        m = Module()
        walk, acts = _Columns(self.derived), _Step()
        around = SerialTurns(self.derived) if self.derived.skin.closed else None
        group = _Group(self.derived, len(walk.place))
        # Does the zone of the run of the row before have others in that row?
        earlier = Signal()
        later = Signal()
        m.submodules.earlier = earlier_runs = memory.Memory(shape=1, depth=self.derived.open_zones, init=[])
        m.submodules.later = later_runs = memory.Memory(shape=1, depth=self.derived.open_zones, init=[])
        # Walk, a column at a time
        self._walk(m, walk, acts, around)
        self._cut(m, walk, acts, earlier & ~group.whole, around)
        # Brackets of the run of the row before
        read_earlier = earlier_runs.read_port()
        read_later = later_runs.read_port()
        self._read_bracket(m, walk, acts, read_earlier)
        self._read_bracket(m, walk, acts, read_later)
        m.d.comb += [earlier.eq(read_earlier.data), later.eq(read_later.data)]
        if around is not None:
            m.submodules.linked_runs = around.linked_runs
            read_linked = around.linked_runs.read_port()
            self._read_bracket(m, walk, acts, read_linked)
            with m.If(around.at_seam):
                m.d.comb += [earlier.eq(1), later.eq(0)]
            around.find(m, acts, earlier, later, group.whole, read_linked.data)
        # The upper half of the memory stays zero: what is read there adds nothing.
        stored = _stored_layout(self.derived, len(walk.place))
        m.submodules.groups = groups = memory.Memory(shape=stored, depth=2 << len(walk.place), init=[])
        found = self._read_group(m, walk, acts, group, groups, earlier)
        if nesting(self.derived):
            self._nest(m, acts, group, earlier, later, found.below, around)
        above = Const(0, 3)
        if around is not None:
            above = self._go_around(m, acts, walk, group, found, earlier, around)
        # Runs of the group, and their brackets
        self._know_runs(m, walk, acts, group, found)
        write = self._write_brackets(m, walk, acts, group, found, earlier_runs, later_runs)
        if around is not None:
            write_linked = around.linked_runs.write_port()
            m.d.comb += [
                write_linked.en.eq(write.en),
                write_linked.addr.eq(write.addr),
                write_linked.data.eq(around.link(group.has_run, acts.starts, found)),
            ]
        # Moments
        self._sum(m, walk, acts, group, found, above)
        self._store_group(m, acts, group, groups, around)
        self._let_out(m, walk, acts, group)
        return m

    def _walk(self, m: Module, walk: _Columns, acts: _Step, around: SerialTurns | None) -> None:
        row = self.rows.payload
        handed = self.rows.valid & ~walk.active & ~walk.tail
        last = walk.column == self.derived.skin.columns - 1
        m.d.comb += [
            self.rows.ready.eq(acts.enable & ~walk.active & ~walk.tail),
            walk.next_column.eq(Mux(walk.active, walk.column + 1, 0)),
        ]
        passes, ends = acts.advance, last
        if around is not None:
            passes, ends = acts.advance & ~around.at_seam, last & ~around.meets
            advance = acts.enable & walk.active & acts.advance
            around.walk(m, acts.enable & handed, row.cells, walk.before[1:], last & ~around.at_seam, advance)
        with m.If(acts.enable):
            m.d.sync += [walk.tail.eq(0), walk.second.eq(~acts.advance)]
            with m.If(passes):
                m.d.sync += [walk.cell_left.eq(walk.cell), walk.before_left.eq(walk.cell_before)]
            with m.If(Mux(walk.active, passes, handed)):
                m.d.sync += [
                    walk.cells.eq(Mux(walk.active, walk.cells >> 1, row.cells)),
                    walk.before.eq(Cat(walk.before[1:], walk.cell & ~walk.last)),
                    walk.column.eq(walk.next_column),
                    walk.active.eq(~walk.active | ~ends),
                    walk.tail.eq(walk.active & ends),
                ]
            if around is not None:
                with m.If(around.at_seam & acts.advance):
                    m.d.sync += [walk.active.eq(0), walk.tail.eq(1)]
            with m.If(handed):
                counted = Mux(walk.last, 0, walk.y + 1)
                m.d.sync += [walk.last.eq(row.last), walk.y.eq(row.y if self.derived.skips else counted)]

    def _cut(self, m: Module, walk: _Columns, acts: _Step, waits: Value, around: SerialTurns | None) -> None:
        """Whether a cluster ends: with 8-connectivity at an empty column, otherwise where neither row continues.

        ``waits``: the group waits for the run of the row before if one begins.
        """
        inside = walk.cell_left | walk.before_left
        begins, goes_on = walk.cell_before & ~walk.before_left, walk.cell | walk.cell_before
        if around is not None:
            begins, goes_on = begins | around.at_seam, goes_on | around.at_seam
        m.d.comb += acts.begins.eq(begins)
        if self.derived.skin.connectivity == 8:
            two = acts.begins
            m.d.comb += [
                acts.closes.eq(inside & ~goes_on),
                acts.adds.eq(walk.cell & ~walk.second),
            ]
        else:
            ends = Signal()
            m.d.comb += ends.eq(inside & ~(walk.cell & walk.cell_left | walk.cell_before & walk.before_left))
            two = acts.begins | ends & walk.cell
            # A run of the row before whose zone the group has waited for goes on with the group.
            awaited = acts.begins & waits if around is None else acts.begins & waits | around.at_seam
            m.d.comb += [
                acts.closes.eq(ends & ~awaited & ~walk.second),
                acts.adds.eq(walk.cell & (walk.second == ends)),
            ]
            if around is not None:
                m.d.comb += acts.apart.eq(ends & ~around.at_seam)
        m.d.comb += [
            acts.advance.eq(walk.second | ~two),
            acts.starts.eq(acts.adds & ~walk.cell_left),
            acts.joins.eq(acts.begins & walk.second),
        ]

    def _read_bracket(self, m: Module, walk: _Columns, acts: _Step, read: memory.ReadPort) -> None:
        # With 8-connectivity a place is two columns'. It is read before a run of the new row can begin in either.
        odd = walk.column[0] if self.derived.skin.connectivity == 8 else 1
        m.d.comb += [
            read.en.eq(~walk.active | acts.advance & odd),
            read.addr.eq(place_of(self.derived, walk.next_column)),
        ]

    def _write_brackets(
        self,
        m: Module,
        walk: _Columns,
        acts: _Step,
        group: _Group,
        found: data.View,
        earlier_runs: memory.Memory,
        later_runs: memory.Memory,
    ) -> memory.WritePort:
        """Write the brackets: a run has later ones until its zone is known to have none; it has earlier ones if its
        group has. Returns the port of the latter."""
        write_earlier = earlier_runs.write_port()
        write_later = later_runs.write_port()
        m.d.comb += [
            write_earlier.en.eq(acts.enable & (acts.starts | found.has_run & group.has_run)),
            write_earlier.addr.eq(Mux(acts.starts, walk.place, group.first)),
            write_earlier.data.eq(group.has_run),
            write_later.en.eq(acts.enable & (acts.starts | acts.closes & group.whole & group.has_run)),
            write_later.addr.eq(Mux(acts.starts, walk.place, group.end)),
            write_later.data.eq(acts.starts),
        ]
        return write_earlier

    def _nest(
        self,
        m: Module,
        acts: _Step,
        group: _Group,
        earlier: Value,
        later: Value,
        below: Value,
        around: SerialTurns | None,
    ) -> None:
        # For each zone with runs of the row before passed and to come, the innermost first, whether its group has no
        # other one further out.
        outermost = Signal(nesting(self.derived) + self.derived.skin.closed)
        with m.If(acts.enable):
            with m.If(acts.closes):
                m.d.sync += group.whole.eq(1)
            with m.Elif(acts.joins & later):
                m.d.sync += group.whole.eq(0)
            with m.Elif(acts.joins & earlier):
                m.d.sync += group.whole.eq(outermost[0])
            with m.If(acts.joins & (earlier ^ later)):
                m.d.sync += outermost.eq(Mux(later, Cat(group.whole, outermost), outermost >> 1))
            with m.If(acts.closes & ~group.whole):
                m.d.sync += group.innermost.eq(group.first)
            with m.Elif(acts.joins & earlier & group.whole):
                m.d.sync += group.innermost.eq(below)
        if around is not None:
            with m.If(around.begins):
                m.d.sync += [group.whole.eq(0), outermost.eq(Cat(1, outermost))]

    def _go_around(
        self,
        m: Module,
        acts: _Step,
        walk: _Columns,
        group: _Group,
        found: data.View,
        earlier: Value,
        around: SerialTurns,
    ) -> Value:
        over = acts.closes | ~walk.active
        joins, zone = acts.joins & (~earlier | group.whole), acts.joins & ~earlier
        unwrap = around.unwrap(m, group.moments, found.moments, joins, zone, acts.adds)
        with m.If(acts.enable):
            around.keep(m, acts.starts, group.has_run, found, over)
            m.d.sync += [group.moments[name].eq(unwrap.group[name]) for name in unwrap.group.shape().members]
        return unwrap.above

    def _read_group(
        self, m: Module, walk: _Columns, acts: _Step, group: _Group, groups: memory.Memory, earlier: Value
    ) -> data.View:
        """The zone or group that joins this one, requested in the clock before; 0 for none."""
        read = groups.read_port()
        wanted = Signal()
        m.d.comb += [
            wanted.eq(acts.begins & ~walk.second & (~earlier | group.whole)),
            read.addr.eq(Cat(Mux(earlier, group.innermost, walk.place), ~wanted)),
        ]
        return read.data

    def _know_runs(self, m: Module, walk: _Columns, acts: _Step, group: _Group, found: data.View) -> None:
        with m.If(acts.enable):
            with m.If(~group.has_run):
                m.d.sync += group.first.eq(walk.place)
            with m.If(found.has_run):
                m.d.sync += group.first.eq(found.first)
            with m.If(acts.starts):
                m.d.sync += group.end.eq(walk.place)
            with m.Elif(~group.has_run):
                m.d.sync += group.end.eq(found.end)
            with m.If(acts.starts | found.has_run):
                m.d.sync += group.has_run.eq(1)
            with m.If(acts.closes | ~walk.active):
                m.d.sync += group.has_run.eq(0)

    def _sum(self, m: Module, walk: _Columns, acts: _Step, group: _Group, found: data.View, above: Value) -> None:
        """Add the cell, or what is ``found``, never both."""
        with m.If(acts.enable):
            for name, share in (("area", 1), ("sum_x", walk.column), ("sum_y", walk.y)):
                more = found.moments[name] | Mux(acts.adds, share, 0)
                m.d.sync += group.moments[name].eq(group.moments[name] + more)
            if self.derived.skin.extent:
                from contactfpga_hdl.label.extent import extent_of_run, larger, lifted

                fields = extent_of_run(self.derived, walk.column, walk.column, walk.y)
                cell = {name: Mux(acts.adds, field, 0) for name, field in fields.items()}
                kept, joins, adds = (
                    lifted(self.derived, *part) for part in zip((group.moments, found.moments, cell), above)
                )
                extent = larger((kept, {name: joins[name] | adds[name] for name in kept}))
                m.d.sync += [group.moments[name].eq(field) for name, field in extent.items()]
        with m.If(acts.enable & (acts.closes | ~walk.active)):  # at power-up what the memory reads is not known
            m.d.sync += group.moments.eq(0)

    def _store_group(
        self, m: Module, acts: _Step, group: _Group, groups: memory.Memory, around: SerialTurns | None
    ) -> None:
        write = groups.write_port()
        m.d.comb += [
            write.en.eq(acts.closes & (group.has_run | ~group.whole)),
            write.addr.eq(group.first),
            write.data.moments.eq(group.moments),
            write.data.has_run.eq(group.has_run & ~group.whole),
            write.data.first.eq(group.first),
            write.data.end.eq(group.end),
            write.data.below.eq(group.innermost),
        ]
        if around is not None:
            back = group.moments.back & ~(group.whole & around.first_turn)
            turns = [write.data.first_turn.eq(around.first_turn), write.data.last_turn.eq(around.last_turn)]
            m.d.comb += [write.data.moments.back.eq(back), *turns]

    def _let_out(self, m: Module, walk: _Columns, acts: _Step, group: _Group) -> None:
        mark = Signal()
        leaves = acts.closes & group.whole & (~group.has_run | walk.last)
        m.d.comb += [
            self.records.valid.eq(leaves | mark),
            self.records.payload.zone.eq(zone_of(self.derived, group.moments)),
            self.records.payload.end.eq(mark),
            acts.enable.eq(~self.records.valid | self.records.ready),
        ]
        with m.If(acts.enable):
            m.d.sync += mark.eq(walk.tail & walk.last)
