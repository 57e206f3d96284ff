"""The moments of each zone: added up step by step, kept from row to row, emitted when the zone is closed."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import memory, stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin.derived import Derived
from contactfpga_hdl.label.steps import join_layout, place_of, step_layout, waiting
from contactfpga_hdl.label.unwrap import Unwrap, kept_layout, zone_of
from contactfpga_hdl.payloads import record_layout
from contactfpga_hdl.util.stack import Stack


class Sum(wiring.Component):
    """Adds up the moments of each zone.

    enable (in): nothing changes without it.
    valid, join (in): what a step adds to its zone, and what becomes of it.
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
            m.submodules.unwrap = unwrap = Unwrap(self.derived)
            m.d.comb += [
                unwrap.kept.eq(kept),
                unwrap.found.eq(Mux(join.pop, stack.top, Mux(join.load, read.data, 0))),
                unwrap.joins.eq(join.pop | join.load),
                unwrap.zone.eq(join.load),
                unwrap.cells.eq(join.run.area),
                *(getattr(unwrap, name).eq(join[name]) for name in ("down", "turn", "ring")),
            ]
            m.d.comb += [group[name].eq(unwrap.group[name]) for name in unwrap.group.shape().members]
            stored = Signal(moments)
            m.d.comb += [stored.eq(group), stored.back.eq(group.back & ~join.first_turn)]
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
