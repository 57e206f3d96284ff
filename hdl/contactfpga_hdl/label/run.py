"""Contact zones and their moments, in one pass over the rows as they arrive (docs/labelling.md).

The connected pieces of two adjacent rows alone, *clusters*, are walked from left to right, one run of each row per
clock. Two bits per run tell whether a run of the same zone precedes it in its row, and whether one follows. Zones never
cross in the plane, so these bits nest like brackets, and a stack replaces equivalence tables.

A zone's moments are in a table at the start column of its first run in the row (halved with 8-connectivity). Runs of
different zones in the same or adjacent rows never share a place, so the table cannot overflow.
"""

from amaranth.hdl import Const, Module, Mux, Signal
from amaranth.lib import memory, stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga_hdl.label.join import Join
from contactfpga_hdl.label.steps import Walk, join_layout, kept_layout, place_bits, zone_of
from contactfpga_hdl.payloads import labeller_ports, record_layout


class RunLabeller(wiring.Component):
    """Rows in, zone records out, by runs of pressed cells; ports as in
    :func:`~contactfpga_hdl.payloads.labeller_ports`.

    A row with n steps takes n + 2 clocks, two empty rows one; a zone leaves three clocks after the last step with one
    of its cells (docs/timing.md). Of C columns a row has at most ceil(C/2) steps with 8-connectivity and C with 4. Each
    step passes walk, join and sum in three clocks.
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
            sums.lookup.eq(join.lookup),
        ]
        return m


class Sum(wiring.Component):
    """Adds up the moments of each zone.

    enable (in): nothing changes without it.
    valid, join (in): a step's addition to its zone, and the zone's fate.
    lookup (in): one clock before ``join``, the place of the data that it loads.
    records (out): in the clock of the step that closes the zone.
    """

    def __init__(self, derived: Derived):
        self.derived = derived
        super().__init__(
            {
                "enable": In(1),
                "valid": In(1),
                "join": In(join_layout(derived)),
                "lookup": In(place_bits(derived) + 1),
                "records": Out(stream.Signature(record_layout(derived))),
            }
        )

    def elaborate(self, platform):
        m = Module()
        moments = kept_layout(self.derived)
        join = self.join
        works = self.enable & self.valid & ~join.end
        # Table of the zones of the row before, and of waiting groups
        m.submodules.table = table = memory.Memory(shape=moments, depth=2 << place_bits(self.derived), init=[])
        write = table.write_port()
        read = table.read_port()
        # Moments of the group so far, of what joins it, and of the new run
        kept = Signal(moments)
        group = Signal(moments)
        stored = Signal(moments)
        before = Signal(moments)  # what was stored in the clock before
        found = Signal(moments)
        m.d.comb += found.eq(Mux(join.again, before, Mux(join.load, read.data, 0)))
        for name in ("area", "sum_x", "sum_y"):
            # Only the first run of its zone loads, and only the later ones can find it on the stack.
            m.d.comb += group[name].eq((kept[name] + join.run[name]) + found[name])
        m.d.comb += stored.eq(group)
        above = Const(0, 3)
        if self.derived.skin.closed:
            from contactfpga_hdl.label.around import unwrapped

            above = unwrapped(m, self.derived, join, kept, found, group, stored)
        if self.derived.skin.extent:
            from contactfpga_hdl.label.extent import larger, lifted

            parts = zip((kept, join.run, found), (above[0], above[2], above[1]))
            extent = larger(lifted(self.derived, part, up) for part, up in parts)
            m.d.comb += [group[name].eq(field) for name, field in extent.items()]
        with m.If(works):
            m.d.sync += [kept.eq(group), before.eq(group)]
            with m.If(join.closes):
                m.d.sync += kept.eq(0)
        # Table and records
        m.d.comb += [
            read.en.eq(self.enable),
            read.addr.eq(self.lookup),
            write.en.eq(works & join.store),
            write.addr.eq(join.place),
            write.data.eq(stored),
            self.records.valid.eq(self.valid & join.leaves),
            self.records.payload.zone.eq(zone_of(self.derived, group)),
            self.records.payload.end.eq(join.end),
        ]
        return m
