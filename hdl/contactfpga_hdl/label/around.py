"""Turns of clusters, runs and cells of a sheet whose ends meet (docs/labelling.md).

Columns count on past the seam, over two adjacent turns. A zone's runs, from left to right, are on one turn, or from
some run on a turn back: one bit tells which. The same holds for clusters of a group. If two paths disagree by a turn,
the zone is a ring around the cylinder.

A group's cells are on the turn of its first cluster and on an adjacent one, the next or the one *back*; ``turned``
counts the cells on the upper one. A group that needs a third turn is ``wound``.
"""

from typing import Protocol

from amaranth.hdl import Cat, Elaboratable, Module, Mux, Signal, Value
from amaranth.lib import data, memory

from contactfpga.skin.derived import Derived
from contactfpga_hdl.label.steps import kept_layout, nesting, over_the_seam, turned_layout


class Turns:
    """The turn of the walked cluster: from the zone of a run of the row before that has an earlier run, and at the
    seam, where the last cluster is a turn back from the first."""

    def __init__(self, derived: Derived):
        self.seam = Signal(name="joins_seam")  # the last cluster is joined with the first one
        self.turn = Signal(name="turn_now")
        self.down = Signal()  # what the group had before is now known to lie a turn back
        self.ring = Signal()
        self._zones = Signal(nesting(derived), name="zone_turns")  # of zones with runs passed and to come, inner first

    def find(self, m: Module, turn: Value, goes_on: Value, pop: Value, apart: Value, linked: Value) -> None:
        """Determine the turn.

        turn: the turn as known so far.
        goes_on: a run of the row before has an earlier one of its zone; ``linked``: it is a turn further back than that
            one.
        pop: the run or the seam joins a waiting group.
        apart: the run does not touch the cluster before it, though the group continues.
        """
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
        """Store the turn for the zone of a run of the row before that ``passes``."""
        with m.If(passes):
            kept = Mux(earlier, self._zones >> 1, self._zones)
            m.d.sync += self._zones.eq(Mux(later, Cat(self.turn, kept), kept))


class Unwrap(Elaboratable):
    """The turns of a group while cells and found groups are added.

    kept, down (in): the group so far, and whether all of it is now known to be a turn back.
    found, joins, zone (in): the group that joins, or zeros: a zone of the row before, or a waiting group, whose first
        cluster becomes the group's.
    turn, cells (in): turn of the walked cluster, and number of its new cells.
    ring (in): the group becomes a ring.
    group (out): the resulting group.
    above (out), with ``extent``: whether all cells of ``kept``, of ``found``, and the new cells are on the upper turn.
    """

    def __init__(self, derived: Derived):
        self.kept, self.found = (Signal(kept_layout(derived), name=f"turned_{name}") for name in ("kept", "found"))
        self.down, self.joins, self.zone, self.turn, self.ring = (
            Signal(name=f"turned_{name}") for name in ("down", "joins", "zone", "turn", "ring")
        )
        self.cells = Signal(derived.area_bits, name="turned_cells")
        self.group = Signal(data.StructLayout(turned_layout(derived)), name="turned_group")
        self.above = Signal(3, name="turned_above")
        self._extent = derived.skin.extent

    def elaborate(self, platform):
        m = Module()
        kept, found, group = self.kept, self.found, self.group
        # A turn back, or two, from the group's first cluster: the lower turn of what there was and of what joins it.
        moved = self.zone & self.turn
        kept_back, found_back = kept.back | self.down, self.joins & (found.back | moved)
        too_far = kept.back & self.down | self.joins & found.back & moved
        back = kept_back | found_back | self.turn
        kept_above, found_above, cells_above = back & ~kept_back, self.joins & back & ~found_back, back & ~self.turn
        shares = (
            Mux(kept_above, kept.area, kept.turned),
            Mux(found_above, found.area, found.turned),
            Mux(cells_above, self.cells, 0),
        )
        m.d.comb += [
            group.back.eq(back),
            group.two.eq(kept.two | found.two | kept_above | found_above | cells_above),
            group.turned.eq((shares[0] + shares[2]) + shares[1]),
            group.wound.eq(kept.wound | found.wound | too_far | kept_above & kept.two | found_above & found.two),
            group.ring.eq(kept.ring | found.ring | self.ring),
        ]
        if self._extent:
            m.d.comb += self.above.eq(Cat(kept_above, found_above, cells_above))
        return m


def stored_turns() -> dict[str, int]:
    return {"first_turn": 1, "last_turn": 1}


def unwrapped(
    m: Module, derived: Derived, join: data.View, kept: data.View, found: Value, group: data.View, stored: data.View
) -> Value:
    """Add turns to a ``group`` of the labeller ``run``, from ``kept`` and ``found``, and to its word in the table.
    Returns ``Unwrap.above``."""
    m.submodules.unwrap = unwrap = Unwrap(derived)
    m.d.comb += [
        unwrap.kept.eq(kept),
        unwrap.found.eq(found),
        unwrap.joins.eq(join.load | join.again),
        unwrap.zone.eq(join.begun),
        unwrap.cells.eq(join.run.area),
        *(getattr(unwrap, name).eq(join[name]) for name in ("down", "turn", "ring")),
    ]
    m.d.comb += [group[name].eq(unwrap.group[name]) for name in unwrap.group.shape().members]
    # A zone in the table is on the turn of its first run, a waiting group on that of its first cluster.
    with m.If(join.first_turn & ~join.place[-1]):
        m.d.comb += stored.back.eq(0)
    return unwrap.above


class Acts(Protocol):
    enable: Signal
    joins: Signal
    apart: Signal


class SerialTurns:
    """Turns of the labeller ``serial``: registers and memory for the walked group.

    The seam is one more zone of the row before, which begins before the first column and ends after the last column.
    """

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
        m.d.comb += self.begins.eq(handed & over_the_seam(self.derived, row, before))
        with m.If(handed):
            m.d.sync += self.meets.eq(self.begins)
        with m.If(advance):
            m.d.sync += self.at_seam.eq(last_column & self.meets & ~self.at_seam)

    def find(self, m: Module, acts: Acts, earlier: Value, later: Value, whole: Value, linked: Value) -> None:
        """Determine the cluster's turn when a run of the row before, or the seam, joins its group."""
        joins = acts.joins
        m.d.comb += self.turns.seam.eq(joins & self.at_seam)
        self.turns.find(m, self.turn, joins & earlier, joins & earlier & whole, acts.apart, linked)
        self.turns.keep(m, acts.enable & joins & ~self.at_seam, earlier, later)

    def keep(self, m: Module, starts: Value, has_run: Value, found: data.View, over: Value) -> None:
        """Update in a clock in which a run ``starts``, or ``found`` joins, and in which the group may be ``over``."""
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
        """Whether a run is a turn further back than its earlier one: the run that ``starts``, or the group's first as
        ``found`` joins."""
        onto = has_run & self.turn & ~self.last_turn
        return Mux(starts, onto, (self.first_turn | self.turns.down) & ~found.last_turn)

    def unwrap(self, m: Module, kept: data.View, found: data.View, joins: Value, zone: Value, adds: Value) -> Unwrap:
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
        return unwrap
