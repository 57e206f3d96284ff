"""What a row holds and whether it changed, seen before the labeller and apart from it."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import memory, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.derived import Derived
from contactfpga.skin import Skin
from contactfpga_hdl.payloads import moments_layout, row_layout


class Tally(wiring.Component):
    """Moments of each row, for the one clock that lies two behind ``taken``; otherwise zero."""

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = Derived(skin)
        super().__init__(
            {
                "taken": In(1),
                "row": In(row_layout(self.derived)),
                "moments": Out(moments_layout(self.derived)),
            }
        )

    def elaborate(self, platform):
        m = Module()
        columns = self.skin.columns
        cells = Signal(columns)
        counting = Signal()
        y = Signal(range(max(2, self.skin.rows)))
        y_next = Signal.like(y)
        y_counted = Signal.like(y)
        with m.If(self.taken):
            m.d.sync += [cells.eq(self.row.cells), y.eq(y_next), y_next.eq(Mux(self.row.last, 0, y_next + 1))]
        area = Signal(range(columns + 1))
        # Column numbers are summed bit by bit: for each bit, how many pressed columns have it in their number.
        weighted = [
            _count(cells[x] for x in range(columns) if x >> bit & 1) << bit for bit in range((columns - 1).bit_length())
        ]
        m.d.comb += area.eq(_count(cells))
        m.d.sync += [counting.eq(self.taken), self.moments.area.eq(0), self.moments.sum_x.eq(0), y_counted.eq(y)]
        with m.If(counting):
            m.d.sync += [self.moments.area.eq(area), self.moments.sum_x.eq(sum(weighted))]
        m.d.comb += self.moments.sum_y.eq(self.moments.area[: len(area)] * y_counted)
        return m


class Change(wiring.Component):
    """Whether any row since ``clear`` differs from the same row a frame before; one clock after ``taken``."""

    def __init__(self, skin: Skin):
        self.skin = skin
        super().__init__({"taken": In(1), "row": In(row_layout(Derived(skin))), "clear": In(1), "changed": Out(1)})

    def elaborate(self, platform):
        m = Module()
        m.submodules.before = before = memory.Memory(shape=self.skin.columns, depth=self.skin.rows, init=[])
        read, write = before.read_port(), before.write_port()
        y = Signal(range(self.skin.rows))
        m.d.comb += [
            read.addr.eq(y),
            write.addr.eq(y),
            write.data.eq(self.row.cells),
            write.en.eq(self.taken),
        ]
        with m.If(self.clear):
            m.d.sync += self.changed.eq(0)
        with m.If(self.taken):
            m.d.sync += y.eq(Mux(self.row.last, 0, y + 1))
            with m.If(read.data != self.row.cells):
                m.d.sync += self.changed.eq(1)
        return m


def _count(bits):
    """How many of the bits are set, as a balanced tree of adders."""
    numbers = list(bits)
    while len(numbers) > 1:
        pairs = [a + b for a, b in zip(numbers[::2], numbers[1::2], strict=False)]
        numbers = pairs + numbers[len(pairs) * 2 :]
    return numbers[0] if numbers else 0
