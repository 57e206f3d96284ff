"""Contact zones and their moments, in one pass over the rows as they arrive.

Two adjacent rows are looked at together. The connected pieces of these two rows alone, *clusters*, are walked from
left to right, one run of each row per clock. What the zones of the row before look like further up is known from two
bits per run: whether a run of the same zone comes before it in its row, and whether one comes after. Zones never
cross in the plane, so these bits nest like brackets, and a stack replaces equivalence tables: a zone that has more
runs to the right waits on the stack, and the innermost one is always the next that is needed.

A zone's moments lie in a table at the start column of its first run in the row (halved with 8-connectivity). Two
runs of different zones in the same row, or in two adjacent rows, never share such a place, so the table
cannot overflow and needs no allocation.
"""

from amaranth.hdl import Module
from amaranth.lib import wiring

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga_hdl.label.join import Join
from contactfpga_hdl.label.ports import labeller_ports
from contactfpga_hdl.label.sum import Sum
from contactfpga_hdl.label.walk import Walk


class RunLabeller(wiring.Component):
    """Rows in, zone records out; work follows the runs of pressed cells.

    A row with n steps takes n + 1 clocks; a zone leaves two clocks after the last step in which it has a cell
    (docs/timing.md). With C columns a row takes at most ceil(C/2) steps with
    8-connectivity and C with 4. Each step passes walk, join and sum in three clocks.

    rows (in): a frame's rows in ascending order.
    records (out): its zones, then an end mark.
    """

    def __init__(self, skin: Skin):
        self.derived = Derived(skin)
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
