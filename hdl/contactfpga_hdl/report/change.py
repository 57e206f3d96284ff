"""Comparison of a frame with the one before."""

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import memory, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga_hdl.payloads import row_layout


class Change(wiring.Component):
    """Whether the rows since ``clear`` differ from those of a frame before, one clock after ``taken``.

    If the scan skips rows, only rows with a pressed cell are compared, with their numbers, and at the last one their
    count.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = skin.derived
        super().__init__({"taken": In(1), "row": In(row_layout(self.derived)), "clear": In(1), "changed": Out(1)})

    def elaborate(self, platform):
        m = Module()
        skips = self.derived.skips
        row = self.row
        word = Cat(row.cells, row.y) if skips else row.cells
        # Memory of the frame before
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
        # Comparison, with skipped rows also of how many there are
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
