"""What the labeller's records are held against: the zones of a frame, found row by row with all their cells.

No runs, clusters, brackets or places here: the cells of two adjacent rows are the nodes of a graph, and what belongs
together is its closure. :func:`rows_find_the_zones` shows that these are the zones of a flood fill over the frame.
"""

from amaranth.hdl import Cat, Elaboratable, Module, Mux, Signal, Value
from amaranth.lib import data

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga_hdl.payloads import moments_layout
from contactfpga_sim.verify.proofs.proof import Proof

FIELDS = ("area", "sum_x", "sum_y")


class OpenRow:
    """A row and the zones it belongs to: for each column the columns of the same zone, and that zone's moments."""

    def __init__(self, derived: Derived, name: str):
        columns = range(derived.skin.columns)
        self.derived = derived
        self.cells = Signal(len(columns), name=f"{name}_cells")
        self.reach = [Signal(len(columns), name=f"{name}_reach_{x}") for x in columns]
        self.moments = [Signal(moments_layout(derived), name=f"{name}_moments_{x}") for x in columns]

    def another(self, name: str) -> "OpenRow":
        """An empty one of its kind."""
        return type(self)(self.derived, name)

    def copy(self, other: "OpenRow", when=1) -> list:
        """Statements that take over another row, or with ``when`` 0 an empty one."""
        return [mine.eq(Mux(when, theirs, 0)) for mine, theirs in zip(self.state(), other.state(), strict=True)]

    def state(self) -> list:
        """All that it holds."""
        return [self.cells, *self.reach, *(moments.as_value() for moments in self.moments)]

    def record(self, x: int) -> Value:
        """What a labeller says of the zone of column x if it ends here."""
        return self.moments[x].as_value()

    def leaders(self) -> list:
        """For each column whether it is the first one of its zone."""
        return [cell & ~self.reach[x][:x].any() if x else cell for x, cell in enumerate(self.cells)]


class RowStep(Elaboratable):
    """From a row to the next one.

    ``after`` is the open row after ``cells``, ``ended`` how many zones with the record ``wanted`` end there: those
    that have no cell in the new row, and in the last row all others, too.
    """

    def __init__(self, derived: Derived, before: OpenRow, cells, last, y, wanted):
        self.derived, self.before, self.cells, self.last, self.y, self.wanted = derived, before, cells, last, y, wanted
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
            for field, weights in zip(FIELDS, ([1] * len(columns), columns, [self.y] * len(columns))):
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
    """For each cell of two rows, first those of the row before, the cells of both rows that belong to its zone."""
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
    """Columns from one to the other, around the cylinder if that is shorter and the ends meet."""
    apart = abs(x - other)
    return min(apart, skin.columns - apart) if skin.closed else apart


def flood_fill(m: Module, derived: Derived, frame, wanted):
    """How many zones of a frame have the moments ``wanted``: every pressed cell spreads over the whole frame."""
    reach = spread(m, derived.skin, frame, turns=0)
    count = 0
    for i, zone in enumerate(reach):
        found = moments_of(m, derived, zone, i)
        first = frame[i] & ~zone[:i].any() if i else frame[i]
        count += first & (found.as_value() == wanted)
    return count


def spread(m: Module, skin: Skin, frame, turns: int) -> list[Signal]:
    """For each cell of a frame the cells of its zone, on this turn and on as many turns before and after it: the lowest
    bits are of the first turn."""
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
    """Moments of the cells of a frame that are set."""
    found, columns = Signal(moments_layout(derived), name=f"zone_moments_{number}"), derived.skin.columns
    for field, weight in zip(FIELDS, (lambda _: 1, lambda i: i % columns, lambda i: i // columns)):
        m.d.comb += found[field].eq(sum(Mux(cell, weight(i), 0) for i, cell in enumerate(zone)))
    return found


def open_rows_agree(proof: Proof, open_row: OpenRow) -> None:
    """Lemmas: what the registers of an :class:`OpenRow` can hold."""
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
