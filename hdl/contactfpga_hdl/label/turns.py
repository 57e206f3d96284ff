"""On which turn of the cylinder clusters and runs lie, where a sheet's ends meet.

Columns count on past the seam. A zone's runs, from left to right, lie on one turn, or from some run on they lie a turn
back, because their way to the first one leads over the seam: one bit says which. Clusters of a group likewise. Where
two ways disagree by a turn they go round the cylinder, as a ring.
"""

from amaranth.hdl import Cat, Module, Mux, Signal, Value

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
    """The turn of the cluster that is walked.

    It is known from the zone of a run of the row before that has an earlier one, and at the seam: the first cluster is
    the neighbor of the last one, which therefore lies a turn back.
    """

    def __init__(self, derived: Derived):
        self.seam = Signal(name="joins_seam")  # the last cluster is joined with the first one
        self.turn = Signal(name="turn_now")
        self.down = Signal()  # what the group had before is now known to lie a turn back
        self.ring = Signal()
        self._zones = Signal(nesting(derived), name="zone_turns")  # of zones with runs passed and to come, inner first

    def find(self, m: Module, turn: Value, goes_on: Value, pop: Value, apart: Value, linked: Value) -> None:
        """``turn``: as known so far. ``goes_on``: a run of the row before has an earlier one of its zone, and lies a
        turn further back than that if ``linked``. ``pop``: what it or the seam joins waited. ``apart``: the run does
        not touch the cluster before it, though the group goes on."""
        m.d.comb += [
            self.turn.eq(turn),
            self.ring.eq(~pop & ~apart & (self.turn != turn)),
            self.down.eq(pop & self.turn & ~turn),
        ]
        with m.If(self.seam):
            m.d.comb += self.turn.eq(1)
        with m.Elif(goes_on):
            m.d.comb += self.turn.eq(self._zones[0] | linked)

    def keep(self, m: Module, passes: Value, earlier: Value, later: Value) -> None:
        """Remember it for the zone of a run of the row before that ``passes``."""
        with m.If(passes):
            kept = Mux(earlier, self._zones >> 1, self._zones)
            m.d.sync += self._zones.eq(Mux(later, Cat(self.turn, kept), kept))
