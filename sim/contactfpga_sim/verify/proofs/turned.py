"""On which turns a zone's cells lie where a sheet's ends meet, found row by row: offsets along the ways of a graph.

As in :mod:`contactfpga_sim.verify.proofs.zones` the cells of two rows are nodes. A way over the seam adds a turn or
takes one away. Two ways between two cells that differ make a ring. No brackets, links or groups here.
"""

import itertools
from collections.abc import Iterable

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, signed
from amaranth.lib import data

from contactfpga.skin.derived import Derived
from contactfpga_hdl.label.around import kept_layout
from contactfpga_sim.verify.proofs.proof import Proof
from contactfpga_sim.verify.proofs.zones import OpenRow, RowStep, columns_apart, moments_of, spread

Way = tuple[int, int, Value, Value | int]
"""From node to node, whether there is one, and by how many turns the second then lies further on. The first nodes are
the cells of the row before."""

TURN = signed(4)
"""As far as two cells of two rows can lie apart."""


class TurnedRow(OpenRow):
    """In addition, for each column whether it lies a turn back from the first one of its zone, and how that zone's
    cells lie on turns, as in the gateware: ``turned`` on the upper one of ``two``, the lower of which is the first
    column's or, with ``back``, the one before it."""

    def __init__(self, derived: Derived, name: str):
        super().__init__(derived, name)
        layout = {"turned": derived.area_bits, "two": 1, "back": 1, "wound": 1, "ring": 1}
        columns = range(derived.skin.columns)
        self.behind = Signal(len(columns), name=f"{name}_behind")
        self.turns = [Signal(data.StructLayout(layout), name=f"{name}_turns_{x}") for x in columns]

    def state(self) -> list:
        return [*super().state(), self.behind, *(turns.as_value() for turns in self.turns)]

    def record(self, x: int) -> Value:
        turns = self.turns[x]
        wound = turns.wound.replicate(len(turns.turned))
        return Cat(super().record(x), Mux(turns.ring, self.moments[x].area, turns.turned | wound))


class TurnedStep(RowStep):
    """A step that also follows turns."""

    before: TurnedRow
    after: TurnedRow

    def elaborate(self, platform):
        m = super().elaborate(platform)
        columns = range(self.derived.skin.columns)
        ways = self._ways()
        reach, offsets = _followed(m, ways, 2 * len(columns))
        firsts = [self._turns_from(m, j, ways, reach[len(columns) + j], offsets[len(columns) + j]) for j in columns]
        for x in columns:
            turns, behind = 0, 0
            for j, leader in enumerate(self.after.leaders()):
                of_zone = leader & self.after.reach[x][j]
                turns |= Mux(of_zone, firsts[j].as_value(), 0)
                behind |= of_zone & (offsets[len(columns) + j][len(columns) + x] < 0)
            m.d.comb += [self.after.turns[x].as_value().eq(turns), self.after.behind[x].eq(behind)]
        return m

    def _ways(self) -> list[Way]:
        """Between neighbors, and between cells of the row before that are of one zone."""
        before, cells, skin = self.before, self.cells, self.derived.skin
        count = skin.columns
        over_the_seam = {(count - 1, 0): 1, (0, count - 1): -1}
        found: list[Way] = []
        for x, other in itertools.product(range(count), repeat=2):
            turn, apart = over_the_seam.get((x, other), 0), columns_apart(x, other, skin)
            behind, other_behind = before.behind[x], before.behind[other]
            found.append((x, other, before.reach[x][other], Cat(behind, 0).as_signed() - other_behind))
            if apart <= 1:
                found.append((count + x, count + other, cells[x] & cells[other], turn))
            if apart <= (skin.connectivity == 8):
                found.append((x, count + other, before.cells[x] & cells[other], turn))
                found.append((count + x, other, cells[x] & before.cells[other], turn))
        return found

    def _turns_from(self, m: Module, first: int, ways: list[Way], reach: list, offsets: list) -> data.View:
        """How the zone's cells lie, seen from a column of the new row."""
        before, columns = self.before, range(self.derived.skin.columns)
        zones = [leader & reach[j] for j, leader in enumerate(before.leaders())]
        low = [offsets[j] - before.turns[j].back for j in columns]
        high = [low[j] + before.turns[j].two for j in columns]
        cells, places = reach[len(columns) :], offsets[len(columns) :]
        parts = [*zip(zones, low, high, strict=True), *zip(cells, places, places, strict=True)]
        back = _any(there & (lower < 0) for there, lower, _ in parts)
        lowest, upper = Mux(back, -1, 0), Mux(back, 0, 1)
        turned = sum(cells[k] & (places[k] == upper) for k in columns)
        for j in columns:
            alone = Mux(low[j] == upper, before.moments[j].area, 0)
            shared = Mux(high[j] == upper, before.turns[j].turned, 0)
            turned += Mux(zones[j], Mux(before.turns[j].two, shared, alone), 0)
        wound = _any(there & ((lower < lowest) | (higher > upper)) for there, lower, higher in parts)
        ring = _any(reach[a] & way & (offsets[a] + turn != offsets[b]) for a, b, way, turn in ways)
        turns = Signal.like(before.turns[0], name=f"turns_from_{first}")
        m.d.comb += [
            turns.turned.eq(turned),
            turns.two.eq(_any(there & (higher > lowest) for there, _, higher in parts)),
            turns.back.eq(back),
            turns.wound.eq(wound | _any(zones[j] & before.turns[j].wound for j in columns)),
            turns.ring.eq(ring | _any(zones[j] & before.turns[j].ring for j in columns)),
        ]
        return turns


def empty_row(derived: Derived) -> OpenRow:
    """What the specification knows before a frame: turns only where the ends meet."""
    return (TurnedRow if derived.skin.closed else OpenRow)(derived, "open")


def next_row(m: Module, derived: Derived, before: OpenRow, *given) -> tuple[OpenRow, Signal]:
    """The result of a :class:`RowStep`, or where the ends meet of a :class:`TurnedStep`."""
    m.submodules += (step := (TurnedStep if derived.skin.closed else RowStep)(derived, before, *given))
    return step.after, step.ended


def _followed(m: Module, ways: list[Way], nodes: int) -> tuple[list[list], list[list]]:
    """For each node whether there is a way to each other one, and by how many turns that lies further on."""
    reach = [[_any(way for a, b, way, _ in ways if (a, b) == (i, j)) for j in range(nodes)] for i in range(nodes)]
    turns = {(a, b): turn for a, b, _, turn in ways}
    offsets = [[turns.get((i, j), 0) for j in range(nodes)] for i in range(nodes)]
    for through in range(nodes):
        closer = [[Signal(name=f"way_{through}_{i}_{j}") for j in range(nodes)] for i in range(nodes)]
        further = [[Signal(TURN, name=f"offset_{through}_{i}_{j}") for j in range(nodes)] for i in range(nodes)]
        for i, j in itertools.product(range(nodes), repeat=2):
            by_way = reach[i][through] & reach[through][j]
            m.d.comb += [
                closer[i][j].eq(reach[i][j] | by_way),
                further[i][j].eq(Mux(reach[i][j], offsets[i][j], offsets[i][through] + offsets[through][j])),
            ]
        reach, offsets = closer, further
    return reach, offsets


def _any(bits: Iterable) -> Value:
    return Cat(Const(0), *bits).any()


def flood_around(m: Module, derived: Derived, frame, wanted):
    """How many zones of a frame have the record ``wanted``: every pressed cell spreads over turns of the frame that lie
    side by side. What is no ring takes two rows for each turn."""
    cells = derived.skin.rows * derived.skin.columns
    turns = derived.skin.rows // 2 + 1
    count = 0
    for i, reach in enumerate(spread(m, derived.skin, frame, turns)):
        laps = [reach[turn * cells : (turn + 1) * cells] for turn in range(2 * turns + 1)]
        zone = Cat(_any(lap[j] for lap in laps) for j in range(cells))
        ring = laps[turns + 1][i]
        moments = moments_of(m, derived, zone, i)
        upper, turned, wound = Const(0), Const(0), Const(0)
        seen, above = Const(0), Const(0)  # a turn with cells, and one above it
        for lap in laps:
            wound |= above & lap.any()
            upper = seen & ~above & lap.any()
            turned = Mux(upper, sum(lap), turned)
            above |= upper
            seen |= lap.any()
        marked = Signal(derived.area_bits, name=f"zone_turned_{i}")
        m.d.comb += marked.eq(Mux(ring, moments.area, turned | wound.replicate(derived.area_bits)))
        first = frame[i] & ~zone[:i].any() if i else frame[i]
        count += first & (Cat(moments.as_value(), marked) == wanted)
    return count


def turned_rows_agree(proof: Proof, open_row: TurnedRow) -> None:
    """Lemmas: what its registers can hold."""
    columns = range(len(open_row.cells))
    starts, ends = open_row.cells[0], open_row.cells[-1]
    for x in columns:
        turns, behind = open_row.turns[x], open_row.behind
        placed = open_row.cells[x] & ~turns.ring
        proof.lemma(open_row.cells[x] | ~behind[x] & (turns.as_value() == 0))
        proof.lemma(~(placed & open_row.leaders()[x]) | ~behind[x])
        proof.lemma(~(placed & behind[x] & ~turns.wound) | turns.two & turns.back)
        proof.lemma(turns.ring | turns.wound | turns.two | (turns.turned == 0) & ~turns.back)
        if x:
            proof.lemma(~(placed & open_row.cells[x - 1]) | (behind[x] == behind[x - 1]))
        for j in columns[:x]:
            proof.lemma(~open_row.reach[x][j] | (turns.as_value() == open_row.turns[j].as_value()))
            proof.lemma(~(placed & open_row.reach[x][j] & behind[j]) | behind[x])
    proof.lemma(~(starts & ends & ~open_row.turns[0].ring) | behind[-1] & ~behind[0])


def turns_are_known(proof: Proof, open_row: TurnedRow, x: int, word, linked) -> None:
    """Lemmas, where a run starts at column x: ``word`` in the table and ``linked`` say what the specification knows.

    Of a ring nothing else counts, and of a wound zone only where its runs lie.
    """
    turns, layout = open_row.turns[x], kept_layout(open_row.derived)
    kept = data.View(layout, word[: layout.size])
    starts = open_row.cells & ~(open_row.cells << 1)
    earlier = open_row.reach[x][:x] & starts[:x] if x else Const(0)
    with proof.m.If(open_row.cells[x] & ~earlier.any()):
        proof.lemma(kept.ring == turns.ring)
        proof.lemma(turns.ring | (kept.wound == turns.wound))
        for name in ("turned", "two", "back"):
            proof.lemma(turns.ring | turns.wound | (kept[name] == turns[name]))
    with proof.m.If(earlier.any() & ~turns.ring):
        proof.lemma(linked == (open_row.behind[x] & ~_last(earlier, open_row.behind)))


def _last(bits, values) -> Value:
    """The value at the highest bit that is set."""
    found: Value = Const(0)
    for x in range(len(bits)):
        found = Mux(bits[x], values[x], found)
    return found
