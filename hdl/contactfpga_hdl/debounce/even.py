"""Contact bounce, kept from the stages behind; methods and names as in QMK."""

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import memory, stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga_hdl.payloads import row_layout


class Debounce(wiring.Component):
    """Raw rows in, debounced rows out; C columns take C + 3 clocks, one column a clock.

    Each switch has one word in a memory: with ``sym_defer_pk`` its state and for how many samples the raw one has
    differed, with ``asym_eager_defer_pk`` the samples until it counts as released, 0 when it does.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = Derived(skin)
        super().__init__(self._ports())

    def _ports(self):
        row = row_layout(self.derived)
        return {"raw": In(stream.Signature(row)), "rows": Out(stream.Signature(row))}

    def elaborate(self, platform):
        m = Module()
        press, release = self.derived.press_scans, self.derived.release_scans
        symmetric = self.skin.debounce == "sym_defer_pk"
        longest = max(press, release) if symmetric else release + 1 + max(0, press - 1)
        word_bits = longest.bit_length() + symmetric
        self._raw = Signal()
        self._word = Signal(max(1, word_bits))
        self._next_word = Signal.like(self._word)
        self._next_pressed = Signal()
        self._row = Signal(range(self.skin.rows))
        if symmetric:
            self._defer_both(m, press, release)
        else:
            self._eager_press(m, press, release)
        self._walk_columns(m)
        with m.If(self._finish):
            m.d.sync += self._row.eq(Mux(self._last, 0, self._row + 1))
        return m

    def _defer_both(self, m, press, release):
        pressed, differed = self._word[0], self._word[1:]
        differs = self._raw != pressed
        changes = differs & (differed == Mux(pressed, release, press))
        m.d.comb += [
            self._next_pressed.eq(pressed ^ changes),
            self._next_word.eq(Cat(self._next_pressed, Mux(differs & ~changes, differed + 1, 0))),
        ]

    def _eager_press(self, m, press, release):
        defer = release + 1
        with m.If(self._word == 0):
            m.d.comb += self._next_word.eq(Mux(self._raw, defer + max(0, press - 1), 0))
        with m.Elif((self._word <= defer) & self._raw):
            m.d.comb += self._next_word.eq(defer)
        with m.Else():
            m.d.comb += self._next_word.eq(self._word - 1)
        m.d.comb += self._next_pressed.eq(self._next_word != 0)

    def _walk_columns(self, m):
        columns, rows = self.skin.columns, self.skin.rows
        column_bits, row_bits = (columns - 1).bit_length(), (rows - 1).bit_length()
        m.submodules.state = state = memory.Memory(
            shape=len(self._word), depth=(rows - 1 << column_bits) + columns, init=[]
        )
        read, write = state.read_port(), state.write_port()
        column = Signal(range(columns))
        row = self._row
        raw = Signal(columns)
        last = Signal()
        busy = Signal()
        # Three clocks a column, overlapped: read its word, work out the next one, write it.
        decide = Signal()
        store = Signal()
        finish = Signal()
        self._last, self._decide, self._finish = last, decide, finish
        address, store_address = Signal.like(write.addr), Signal.like(write.addr)
        m.d.comb += [
            read.addr.eq(Cat(column[:column_bits], row[:row_bits])),
            self._word.eq(read.data),
            write.en.eq(store),
            write.addr.eq(store_address),
        ]
        m.d.sync += [
            decide.eq(busy),
            address.eq(read.addr),
            self._raw.eq(raw[0]),
            store.eq(decide),
            store_address.eq(address),
            finish.eq(decide & ~busy),
        ]
        m.d.comb += self.raw.ready.eq(~busy & ~decide & ~store & ~self.rows.valid)
        with m.If(self.raw.valid & self.raw.ready):
            m.d.sync += [raw.eq(self.raw.payload.cells), last.eq(self.raw.payload.last), column.eq(0), busy.eq(1)]
        with m.Elif(busy):
            m.d.sync += [raw.eq(raw >> 1), column.eq(column + 1), busy.eq(column != columns - 1)]
        with m.If(decide):
            m.d.sync += write.data.eq(self._next_word)
            m.d.sync += self.rows.payload.cells.eq(Cat(self.rows.payload.cells, self._next_pressed)[1:])
        with m.If(finish):
            m.d.sync += [self.rows.valid.eq(1), self.rows.payload.last.eq(last)]
        with m.Elif(self.rows.ready):
            m.d.sync += self.rows.valid.eq(0)
