"""Contact zones and their moments, in one pass over the rows as they arrive.

Two adjacent rows are combined. The connected pieces of these rows alone, *clusters*, are walked from left to right, one
run of each row per clock. The connections of the row before further up are in two bits per run: whether a run of the
same zone precedes it in its row, and whether one follows. Zones never cross in the plane, so these bits nest like
brackets, and a stack replaces equivalence tables: a zone with more runs to the right waits on the stack, and the
innermost one is always needed next.

A zone's moments are in a table at the start column of its first run in the row (halved with 8-connectivity). Two runs
of different zones in the same or adjacent rows never share such a place, so the table cannot overflow and needs no
allocation.
"""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import memory, stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga_hdl.label.join import Join
from contactfpga_hdl.label.steps import Walk, join_layout, kept_layout, place_of, step_layout, waiting, zone_of
from contactfpga_hdl.payloads import labeller_ports, record_layout
from contactfpga_hdl.util.stack import Stack


class RunLabeller(wiring.Component):
    """Rows in, zone records out; work follows the runs of pressed cells.

    A row with n steps needs n + 1 clocks; a zone leaves two clocks after the last step with one of its cells
    (docs/timing.md). With C columns a row needs at most ceil(C/2) steps with 8-connectivity and C with 4. Each step
    passes walk, join and sum in three clocks.

    rows (in): a frame's rows in ascending order.
    records (out): its zones, then an end mark.
    """

    def __init__(self, skin: Skin):
        self.derived = skin.derived
        super().__init__(labeller_ports(self.derived))

    def elaborate(self, platform):
        m = Module()
        m.submodules.walk = walk = Walk(self.derived)
        m.submodules.join = join = Join(self.derived)
        m.submodules.sum = sums = Sum(self.derived)
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


class Sum(wiring.Component):
    """Adds up the moments of each zone.

    enable (in): nothing changes without it.
    valid, join (in): a step's addition to its zone, and the zone's fate.
    lookup (in): one clock ahead of ``join``, the start of its run of the row before.
    records (out): in the clock of the step that closes the zone.
    """

    def __init__(self, derived: Derived):
        self.derived = derived
        super().__init__(
            {
                "enable": In(1),
                "valid": In(1),
                "join": In(join_layout(derived)),
                "lookup": In(step_layout(derived)["before"].shape),
                "records": Out(stream.Signature(record_layout(derived))),
            }
        )

    def elaborate(self, platform):
        m = Module()
        moments = kept_layout(self.derived)
        join = self.join
        works = self.enable & self.valid & ~join.end
        m.submodules.stack = stack = Stack(moments, waiting(self.derived))
        m.submodules.table = table = memory.Memory(shape=moments, depth=self.derived.open_zones, init=[])
        write = table.write_port()
        read = table.read_port()
        kept = Signal(moments)
        group = Signal(moments)
        for name in ("area", "sum_x", "sum_y"):
            # Only the first run of its zone loads, and only the later ones can find it on the stack.
            before = Mux(join.pop, stack.top[name], Mux(join.load, read.data[name], 0))
            m.d.comb += group[name].eq((kept[name] + join.run[name]) + before)
        stored = group
        if self.derived.skin.closed:
            from contactfpga_hdl.label.around import unwrapped

            found = Mux(join.pop, stack.top, Mux(join.load, read.data, 0))
            stored = unwrapped(m, self.derived, join, kept, found, group)
        with m.If(works):
            m.d.sync += kept.eq(group)
            with m.If(join.closes):
                m.d.sync += kept.eq(0)
        m.d.comb += [
            stack.enable.eq(works),
            stack.pop.eq(join.pop),
            stack.push.eq(join.push),
            stack.entry.eq(group),
            read.en.eq(self.enable),
            read.addr.eq(place_of(self.derived, self.lookup)),
            write.en.eq(works & join.store),
            write.addr.eq(join.place),
            write.data.eq(stored),
            self.records.valid.eq(self.valid & join.leaves),
            self.records.payload.zone.eq(zone_of(self.derived, group)),
            self.records.payload.end.eq(join.end),
        ]
        return m
