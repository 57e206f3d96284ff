"""What a row holds and whether it changed, seen before the labeller and apart from it."""

import math

from amaranth.hdl import Cat, Module, Mux, Signal, Value
from amaranth.lib import memory, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga_hdl.payloads import moments_layout, row_layout
from contactfpga_hdl.util.popcount import popcount
from contactfpga_hdl.util.row_number import row_number

GROUPS = 4
"""The most groups of a row. Each of a row's steps may hold up the counting, and the next row comes six clocks later."""


class Tally(wiring.Component):
    """Moments of each row, one group of columns per clock.

    A row has at most :data:`GROUPS` groups, an empty one none.

    taken (in): high for the clock in which ``row`` (in) is taken. Only empty rows may be taken while ``busy``.
    moments (out): a group's share in each clock without ``hold``, from two clocks after ``taken`` on; otherwise zero.
    hold (in): no group is counted.
    busy (out): falls after the last group.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = Derived(skin)
        self._columns = 4  # of a group; a power of two
        while skin.columns > GROUPS * self._columns:
            self._columns *= 2
        self._groups = math.ceil(skin.columns / self._columns)
        super().__init__(
            {
                "taken": In(1),
                "row": In(row_layout(self.derived)),
                "moments": Out(moments_layout(self.derived)),
                "hold": In(1),
                "busy": Out(1),
            }
        )

    def elaborate(self, platform):
        m = Module()
        cells = Signal(self._groups * self._columns)
        left = Signal(range(self._groups + 2))  # groups to come, and the one that is being added
        y = Signal(range(max(2, self.skin.rows)))
        first = Signal(range(max(2, self._groups * self._columns)))  # column of the group
        group = cells[: self._columns]
        area = Signal(range(self._columns + 1))
        offsets = Signal(range(math.comb(self._columns, 2) + 1))  # of the pressed columns from the first one, summed
        first_counted = Signal.like(first)
        number = row_number(m, self.derived, self.row, self.taken)
        with m.If(self.taken & self.row.cells.any()):
            m.d.sync += [cells.eq(self.row.cells), first.eq(0), left.eq(self._groups + 1), y.eq(number)]
        with m.Elif(self.busy & ~self.hold):
            m.d.sync += [
                cells.eq(cells >> self._columns),
                first.eq(first + self._columns),
                left.eq(left - 1),
                area.eq(popcount(group)),
                offsets.eq(_count_offsets(group)),
                first_counted.eq(first),
            ]
        m.d.comb += [
            self.busy.eq(left != 0),
            self.moments.area.eq(area),
            self.moments.sum_x.eq(area * first_counted + offsets),
            self.moments.sum_y.eq(area * y),
        ]
        return m


class Change(wiring.Component):
    """Whether the rows since ``clear`` differ from those of a frame before; one clock after ``taken``.

    Where the scan skips rows, rows without a pressed cell make no difference: the others are compared with their
    numbers, and how many there were is compared with the last one.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = Derived(skin)
        super().__init__({"taken": In(1), "row": In(row_layout(self.derived)), "clear": In(1), "changed": Out(1)})

    def elaborate(self, platform):
        m = Module()
        skips = self.derived.skips
        row = self.row
        word = Cat(row.cells, row.y) if skips else row.cells
        m.submodules.before = before = memory.Memory(shape=len(word), depth=self.skin.rows, init=[])
        read, write = before.read_port(), before.write_port()
        place = Signal(range(self.skin.rows + skips))  # where the next row that counts belongs
        counts = self.taken & row.cells.any() if skips else self.taken
        after = place + counts if skips else place + 1
        following = Mux(row.last, 0, after)[: len(place)]
        m.d.comb += [
            read.addr.eq(Mux(self.taken, following, place)),  # rows may follow each other without a pause
            write.addr.eq(place),
            write.data.eq(word),
            write.en.eq(counts),
        ]
        differs = counts & (read.data != word)
        if skips:
            number_before = Signal.like(place)
            with m.If(self.taken & row.last):
                m.d.sync += number_before.eq(after)
            differs |= self.taken & row.last & (after != number_before)
        with m.If(self.clear):
            m.d.sync += self.changed.eq(0)
        with m.If(self.taken):
            m.d.sync += place.eq(following)
            with m.If(differs):
                m.d.sync += self.changed.eq(1)
        return m


def _count_offsets(bits: Value) -> Value:
    """The numbers of the bits that are set, summed: for each bit of the numbers, how many have it."""
    return sum(
        popcount(bit for offset, bit in enumerate(bits) if offset >> place & 1) << place
        for place in range((len(bits) - 1).bit_length())
    )
