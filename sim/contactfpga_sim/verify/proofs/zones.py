"""The reference for the labeller's records: the zones of a frame, found row by row.

The cells of two adjacent rows are the nodes of a graph, and zones are its closure. :func:`rows_find_the_zones` shows
that these are the zones of a flood fill. For closed sheets, offsets along paths give the turns of a zone's cells: a
path over the seam adds or removes a turn, and two different paths between two cells make a ring.
"""

import itertools
from collections.abc import Iterable, Sequence

from amaranth.hdl import Cat, Const, Elaboratable, Module, Mux, Signal, Value, signed
from amaranth.lib import data

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga_hdl.label.around import kept_layout
from contactfpga_hdl.payloads import moments_layout
from contactfpga_sim.verify.proofs.proof import Proof

FIELDS = ("area", "sum_x", "sum_y")


class OpenRow:
    """A row and its zones: for each column the zone's columns and moments."""

    def __init__(self, derived: Derived, name: str):
        columns = range(derived.skin.columns)
        self.derived = derived
        self.cells = Signal(len(columns), name=f"{name}_cells")
        self.reach = [Signal(len(columns), name=f"{name}_reach_{x}") for x in columns]
        self.moments = [Signal(moments_layout(derived), name=f"{name}_moments_{x}") for x in columns]

    def another(self, name: str) -> "OpenRow":
        """An empty row of this kind."""
        return type(self)(self.derived, name)

    def copy(self, other: "OpenRow", when=1) -> list:
        """Statements that copy another row, or with ``when`` 0 an empty one."""
        return [mine.eq(Mux(when, theirs, 0)) for mine, theirs in zip(self.state(), other.state(), strict=True)]

    def state(self) -> list:
        return [self.cells, *self.reach, *(moments.as_value() for moments in self.moments)]

    def record(self, x: int) -> Value:
        """A labeller's record of the zone of column x if it ends here."""
        return self.moments[x].as_value()

    def leaders(self) -> list:
        """Whether each column is the first of its zone."""
        return [cell & ~self.reach[x][:x].any() if x else cell for x, cell in enumerate(self.cells)]


class RowStep(Elaboratable):
    """A step from a row to the next.

    ``after``: the open row after ``cells``; ``ended``: number of zones with the record ``wanted`` that end there,
    without a cell in the new row; in the last row all.
    """

    def __init__(self, derived: Derived, before: OpenRow, cells, last, wanted, weights):
        """``weights``: by field of a zone's moments, what the pressed cell of each column adds."""
        self.derived, self.before, self.cells, self.last, self.wanted = derived, before, cells, last, wanted
        self.weights = weights
        self.after = before.another("next")
        self.ended = Signal(range(2 * derived.skin.columns + 1))

    def elaborate(self, platform):
        m = Module()
        columns = range(self.derived.skin.columns)
        before, after = self.before, self.after
        reach = _closure(m, before, self.cells, self.derived.skin)
        m.d.comb += after.cells.eq(self.cells)
        for x in columns:
            old, new = reach[len(columns) + x][: len(columns)], reach[len(columns) + x][len(columns) :]
            m.d.comb += after.reach[x].eq(new)
            merged = [leader & old[j] for j, leader in enumerate(before.leaders())]
            for field, weights in self.weights.items():
                parts = [Mux(merged[j], before.moments[j][field], 0) for j in columns]
                parts += [Mux(new[k], weights[k], 0) for k in columns]
                m.d.comb += after.moments[x][field].eq(sum(parts))
        ends = [
            leader & ~reach[j][len(columns) :].any() & (before.record(j) == self.wanted)
            for j, leader in enumerate(before.leaders())
        ]
        ends += [self.last & leader & (after.record(x) == self.wanted) for x, leader in enumerate(after.leaders())]
        m.d.comb += self.ended.eq(sum(ends))
        return m


def _closure(m: Module, before: OpenRow, cells, skin: Skin) -> list:
    count = len(cells)
    pressed = [*before.cells, *cells]

    def adjacent(x, other):
        return columns_apart(x, other, skin) <= (1 if skin.connectivity == 8 else 0)

    reach = []
    for x in range(count):
        down = Cat(cells[j] & adjacent(x, j) for j in range(count))
        reach.append(Cat(before.reach[x], Mux(before.cells[x], down, 0)))
    for x in range(count):
        up = Cat(before.cells[j] & adjacent(x, j) for j in range(count))
        beside = Cat(cells[j] & (columns_apart(x, j, skin) <= 1) for j in range(count))
        reach.append(Mux(cells[x], Cat(up, beside), 0))
    for through in range(len(pressed)):
        closer = [Signal(len(pressed), name=f"through_{through}_{i}") for i in range(len(pressed))]
        for i, closed in enumerate(closer):
            m.d.comb += closed.eq(reach[i] | Mux(reach[i][through], reach[through], 0))
        reach = closer
    return reach


def columns_apart(x: int, other: int, skin: Skin) -> int:
    """Columns from one to the other, the shorter way around a cylinder."""
    apart = abs(x - other)
    return min(apart, skin.columns - apart) if skin.closed else apart


def flood_fill(m: Module, derived: Derived, frame, wanted):
    """Number of zones of a frame with the moments ``wanted``, by flood fill."""
    reach = spread(m, derived.skin, frame, turns=0)
    count = 0
    for i, zone in enumerate(reach):
        found = moments_of(m, derived, zone, i)
        first = frame[i] & ~zone[:i].any() if i else frame[i]
        count += first & (found.as_value() == wanted)
    return count


def spread(m: Module, skin: Skin, frame, turns: int) -> list[Signal]:
    """For each cell of a frame its zone's cells, on this turn and ``turns`` before and after; the first turn is
    lowest."""
    cells = skin.rows * skin.columns
    laps, steps = 2 * turns + 1, [(-1, 0), (1, 0), (0, -1), (0, 1)]
    if skin.connectivity == 8:
        steps += [(-1, -1), (-1, 1), (1, -1), (1, 1)]
    width = laps * skin.columns
    places = {
        (y, x): x // skin.columns * cells + y * skin.columns + x % skin.columns
        for y in range(skin.rows)
        for x in range(width)
    }
    reach = [Signal(laps * cells, name=f"seed_{i}") for i in range(cells)]
    m.d.comb += [one.eq(Mux(frame[i], 1 << turns * cells + i, 0)) for i, one in enumerate(reach)]
    for step in range(cells):
        closer = [Signal(laps * cells, name=f"spread_{step}_{i}") for i in range(cells)]
        for one, further in zip(reach, closer):
            for (y, x), place in places.items():
                around = [(y + dy, x + dx) for dy, dx in steps]
                beside = Cat(one[places[other]] for other in around if other in places)
                m.d.comb += further[place].eq(one[place] | frame[place % cells] & beside.any())
        reach = closer
    return reach


def moments_of(m: Module, derived: Derived, zone, number: int) -> data.View:
    """Moments of the set cells of a frame."""
    found, columns = Signal(moments_layout(derived), name=f"zone_moments_{number}"), derived.skin.columns
    for field, weight in zip(FIELDS, (lambda _: 1, lambda i: i % columns, lambda i: i // columns)):
        m.d.comb += found[field].eq(sum(Mux(cell, weight(i), 0) for i, cell in enumerate(zone)))
    return found


def open_rows_agree(proof: Proof, open_row: OpenRow) -> None:
    """Lemmas: possible register contents of an :class:`OpenRow`."""
    columns = range(len(open_row.cells))
    for x in columns:
        reach, moments = open_row.reach[x], open_row.moments[x].as_value()
        proof.lemma((reach & ~open_row.cells) == 0)
        proof.lemma(reach[x] == open_row.cells[x])
        proof.lemma(open_row.cells[x] | (reach == 0) & (moments == 0))
        for j in columns[x + 1 :]:
            same = (reach == open_row.reach[j]) & (moments == open_row.moments[j].as_value())
            proof.lemma((reach[j] == open_row.reach[j][x]) & (~reach[j] | same))
        if x or open_row.derived.skin.closed:
            proof.lemma(~(open_row.cells[x] & open_row.cells[x - 1]) | reach[x - 1])
        for j in columns[x + 1 :]:  # zones do not cross
            between = [reach[k] & open_row.reach[j][k + 1 :].any() for k in columns[j + 1 : -1]]
            proof.lemma(~open_row.cells[j] | reach[j] | ~Cat(Const(0), *between).any())


Way = tuple[int, int, Value, Value | int]
"""By pair of nodes, whether there is a path, and by how many turns the second is further on."""

TURN = signed(4)
"""Largest distance in turns of two cells of two rows."""


class TurnedRow(OpenRow):
    """Also, for each column, whether it is a turn back from the first of its zone, and the turns of that zone's cells,
    as in the gateware: ``turned`` on the upper one of ``two``, of which the lower is the first column's or, with
    ``back``, the one before."""

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
    """The specification's state before a frame."""
    return (TurnedRow if derived.skin.closed else OpenRow)(derived, "open")


def weights_of(derived: Derived, y) -> dict[str, Sequence]:
    """What each column's pressed cell of row ``y`` adds to the moments of its zone."""
    columns = range(derived.skin.columns)
    return {"area": [1] * len(columns), "sum_x": columns, "sum_y": [y] * len(columns)}


def next_row(m: Module, derived: Derived, before: OpenRow, *given) -> tuple[OpenRow, Signal]:
    """Result of a :class:`RowStep`, for closed sheets of a :class:`TurnedStep`."""
    m.submodules += (step := (TurnedStep if derived.skin.closed else RowStep)(derived, before, *given))
    return step.after, step.ended


def _followed(m: Module, ways: list[Way], nodes: int) -> tuple[list[list], list[list]]:
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
    """Number of zones of a frame with the record ``wanted``: every pressed cell spreads over turns of the frame side by
    side. Without a ring, two rows per turn are needed."""
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
    """Lemmas: possible register contents of a :class:`TurnedRow`."""
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
    """Lemmas at a run that starts at column x: ``word`` in the table and ``linked`` agree with the specification.

    Only the places of a wound zone's runs count, and nothing else of a ring.
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
    """The value at the highest set bit."""
    found: Value = Const(0)
    for x in range(len(bits)):
        found = Mux(bits[x], values[x], found)
    return found
