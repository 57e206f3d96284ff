"""On which turn of the cylinder clusters and runs lie, where a sheet's ends meet.

Columns count on past the seam. A zone's runs, from left to right, lie on one turn, or from some run on they lie a turn
back, because their way to the first one leads over the seam: one bit says which. Clusters of a group likewise. Where
two ways disagree by a turn they go round the cylinder, as a ring.
"""

from amaranth.hdl import Cat, Module, Mux, Signal, Value
from amaranth.lib import data

from contactfpga.skin.derived import Derived
from contactfpga_hdl.label.steps import nesting


def turns_layout() -> dict[str, int]:
    """Of a group, all of them from its first cluster on: a 1 is a turn back."""
    return {
        "turn": 1,  # of the cluster that is walked
        "first_turn": 1,  # of the first and the last run
        "last_turn": 1,
    }


class Turns:
    """The turn of the step's cluster.

    It is known from the zone of the step's run of the row before if that has an earlier one, and at the seam: the first
    cluster is the neighbor of the last one, which therefore lies a turn back.
    """

    def __init__(self, derived: Derived):
        self.seam = Signal(name="seam_step")  # the step joins the last cluster with the first one
        self.turn = Signal()
        self.down = Signal()  # what the group had before this step is now known to lie a turn back
        self.ring = Signal()
        self._zones = Signal(nesting(derived), name="zone_turns")  # of zones with runs passed and to come, inner first

    def find(self, m: Module, step: data.View, current: data.View, pop: Value, earlier: Value, linked: Value) -> None:
        """``linked``: the run lies a turn further back than the one of its zone before it."""
        m.d.comb += [
            self.turn.eq(current.turn),
            self.ring.eq(~pop & (self.turn != current.turn)),
            self.down.eq(pop & self.turn & ~current.turn),
        ]
        with m.If(self.seam):
            m.d.comb += self.turn.eq(1)
        with m.Elif(step.has_before & earlier):
            m.d.comb += self.turn.eq(self._zones[0] | linked)

    def keep(self, m: Module, works: Value, step: data.View, earlier: Value, later: Value) -> None:
        """Remember it for the zone of the step's run of the row before."""
        with m.If(works & step.has_before):
            kept = Mux(earlier, self._zones >> 1, self._zones)
            m.d.sync += self._zones.eq(Mux(later, Cat(self.turn, kept), kept))
