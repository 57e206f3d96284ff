"""What the labeller ``serial`` does besides where a sheet's ends meet.

The seam is one more zone of the row before: it begins before the first column, as the outermost of its group, and ends
after the last column, in two clocks as every run of the row before. On which turns cells lie is known as in ``run``.
"""

from typing import Protocol

from amaranth.hdl import Module, Mux, Signal, Value
from amaranth.lib import data, memory

from contactfpga.skin.derived import Derived
from contactfpga_hdl.label.turns import Turns
from contactfpga_hdl.label.unwrap import Unwrap


def stored_turns() -> dict[str, int]:
    """Kept with a group that waits: see :func:`contactfpga_hdl.label.turns.turns_layout`."""
    return {"first_turn": 1, "last_turn": 1}


def over_the_seam(derived: Derived, row: Value, before: Value) -> Value:
    """Whether a cell in the last column of two rows is joined with one in the first."""
    if derived.skin.connectivity == 8:
        return (row | before)[-1] & (row | before)[0]
    return row[-1] & row[0] | before[-1] & before[0]


class Acts(Protocol):
    """What the labeller does in a clock."""

    enable: Signal
    joins: Signal
    apart: Signal


class SerialTurns:
    """Registers and memory for the turns of the group that is walked."""

    def __init__(self, derived: Derived):
        self.derived = derived
        self.begins = Signal(name="seam_begins")  # a row is taken whose last cluster goes on in the first one
        self.meets = Signal()  # the row that is walked is such a one
        self.at_seam = Signal()  # the two clocks after the last column in which that is done
        self.turn = Signal()
        self.first_turn = Signal()
        self.last_turn = Signal()
        self.turns = Turns(derived)
        self.linked_runs = memory.Memory(shape=1, depth=derived.open_zones, init=[])

    def walk(self, m: Module, handed: Value, row: Value, before: Value, last_column: Value, advance: Value) -> None:
        """The seam's clocks come after those of the last column."""
        m.d.comb += self.begins.eq(handed & over_the_seam(self.derived, row, before))
        with m.If(handed):
            m.d.sync += self.meets.eq(self.begins)
        with m.If(advance):
            m.d.sync += self.at_seam.eq(last_column & self.meets & ~self.at_seam)

    def find(self, m: Module, acts: Acts, earlier: Value, later: Value, whole: Value, linked: Value) -> None:
        """The turn of the cluster where a run of the row before, or the seam, joins its group."""
        joins = acts.joins
        m.d.comb += self.turns.seam.eq(joins & self.at_seam)
        self.turns.find(m, self.turn, joins & earlier, joins & earlier & whole, acts.apart, linked)
        self.turns.keep(m, acts.enable & joins & ~self.at_seam, earlier, later)

    def keep(self, m: Module, starts: Value, has_run: Value, found: data.View, over: Value) -> None:
        """In a clock in which a run ``starts``, or what was ``found`` joins, and in which the group may be ``over``."""
        turn, down = self.turns.turn, self.turns.down
        m.d.sync += [
            self.turn.eq(turn),
            self.first_turn.eq(Mux(found.has_run, found.first_turn, Mux(has_run, self.first_turn | down, turn))),
            self.last_turn.eq(Mux(has_run, self.last_turn | down, Mux(found.has_run, found.last_turn, turn))),
        ]
        with m.If(starts):
            m.d.sync += self.last_turn.eq(turn)
        with m.If(over):
            m.d.sync += [self.turn.eq(0), self.first_turn.eq(0), self.last_turn.eq(0)]

    def link(self, has_run: Value, starts: Value, found: data.View) -> Value:
        """Whether the run that gets an earlier one lies a turn further back than that: the one that ``starts``, or the
        group's first one as ``found`` joins it."""
        onto = has_run & self.turn & ~self.last_turn
        return Mux(starts, onto, (self.first_turn | self.turns.down) & ~found.last_turn)

    def unwrap(self, m: Module, kept: data.View, found: data.View, joins: Value, zone: Value, adds: Value) -> data.View:
        """The turns of the group after this clock."""
        m.submodules.unwrap = unwrap = Unwrap(self.derived)
        m.d.comb += [
            unwrap.kept.eq(kept),
            unwrap.found.eq(found),
            unwrap.joins.eq(joins),
            unwrap.zone.eq(zone),
            unwrap.cells.eq(adds),
            unwrap.turn.eq(self.turns.turn),
            unwrap.down.eq(self.turns.down),
            unwrap.ring.eq(self.turns.ring),
        ]
        return unwrap.group
