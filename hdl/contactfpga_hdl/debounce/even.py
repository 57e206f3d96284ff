"""Debounce by samples; methods and names as in QMK."""

from amaranth.hdl import Cat, Module, Mux, Signal, Value
from amaranth.lib import memory, stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga_hdl.payloads import row_layout


class Switch:
    """One switch in the walk: its sampled bit, its word, and the new values of both."""

    def __init__(self, word_bits: int):
        self.raw = Signal()
        self.fresh = Signal()  # the word counts as 0: it is from before a reset, which leaves the memory as it is
        self.word = Signal(word_bits)
        self.next_word = Signal(word_bits)
        self.next_pressed = Signal()


class Phase:
    """Position of the walk over a row."""

    def __init__(self) -> None:
        self.busy = Signal()  # a word is read
        self.decide = Signal()  # the next one is worked out
        self.store = Signal()  # and written
        self.finish = Signal()  # in the first clock after the last column


class Debounce(wiring.Component):
    """Raw rows in, debounced rows out; one column per clock, C columns take C + 3 clocks.

    A memory has a word per switch: with ``sym_defer_pk`` its state and the samples for which the raw one has differed,
    with ``asym_eager_defer_pk`` the samples until the switch counts as released, or 0. In the first frame after reset
    each word reads 0.

    raw (in): a frame's rows in ascending order; taken when the row before has left.
    rows (out): debounced rows.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        row = row_layout(skin.derived)
        super().__init__({"raw": In(stream.Signature(row)), "rows": Out(stream.Signature(row))})

    def elaborate(self, platform):
        m = Module()
        derived = self.skin.derived
        press, release = derived.press_scans, derived.release_scans
        symmetric = self.skin.debounce == "sym_defer_pk"
        longest = max(press, release) if symmetric else release + 1 + max(0, press - 1)
        # Rule of the method
        switch, phase = Switch(max(1, longest.bit_length() + symmetric)), Phase()
        row = Signal(range(self.skin.rows))
        if symmetric:
            _defer_both(m, switch, press, release)
        else:
            _eager_press(m, switch, press, release)
        # Walk over the switches of a row
        last = walk_columns(m, self.skin, self.raw, self.rows, row, switch, phase)
        known = Signal()  # a whole frame was walked
        m.d.comb += switch.fresh.eq(~known)
        with m.If(phase.finish):
            m.d.sync += [row.eq(Mux(last, 0, row + 1)), known.eq(known | last)]
        return m


def _defer_both(m: Module, switch: Switch, press: int, release: int) -> None:
    word = Mux(switch.fresh, 0, switch.word)
    pressed, differed = word[0], word[1:]
    differs = switch.raw != pressed
    changes = differs & (differed == Mux(pressed, release, press))
    m.d.comb += [
        switch.next_pressed.eq(pressed ^ changes),
        switch.next_word.eq(Cat(switch.next_pressed, Mux(differs & ~changes, differed + 1, 0))),
    ]


def _eager_press(m: Module, switch: Switch, press: int, release: int) -> None:
    defer = release + 1
    with m.If(switch.fresh | (switch.word == 0)):
        m.d.comb += switch.next_word.eq(Mux(switch.raw, defer + max(0, press - 1), 0))
    with m.Elif((switch.word <= defer) & switch.raw):
        m.d.comb += switch.next_word.eq(defer)
    with m.Else():
        m.d.comb += switch.next_word.eq(switch.word - 1)
    m.d.comb += switch.next_pressed.eq(switch.next_word != 0)


def walk_columns(
    m: Module,
    skin: Skin,
    raw: stream.Interface,
    rows: stream.Interface,
    row: Value,
    switch: Switch,
    phase: Phase,
) -> Value:
    """Pass each switch of a raw row through ``switch``, with its word from a memory and back; offer the resulting row.

    Returns whether the row is a frame's last; ``row``: its number, until ``phase.finish``.
    """
    columns = skin.columns
    column_bits, row_bits = (columns - 1).bit_length(), (skin.rows - 1).bit_length()
    m.submodules.state = state = memory.Memory(
        shape=len(switch.word), depth=(skin.rows - 1 << column_bits) + columns, init=[]
    )
    read, write = state.read_port(), state.write_port()
    column = Signal(range(columns))
    cells = Signal(columns)
    last = Signal()
    address, store_address = Signal.like(write.addr), Signal.like(write.addr)
    m.d.comb += [
        read.addr.eq(Cat(column[:column_bits], row[:row_bits])),
        switch.word.eq(read.data),
        write.en.eq(phase.store),
        write.addr.eq(store_address),
        raw.ready.eq(~phase.busy & ~phase.decide & ~phase.store & ~rows.valid),
    ]
    m.d.sync += [
        phase.decide.eq(phase.busy),
        address.eq(read.addr),
        switch.raw.eq(cells[0]),
        phase.store.eq(phase.decide),
        store_address.eq(address),
        phase.finish.eq(phase.decide & ~phase.busy),
    ]
    with m.If(raw.valid & raw.ready):
        m.d.sync += [cells.eq(raw.payload.cells), last.eq(raw.payload.last), column.eq(0), phase.busy.eq(1)]
    with m.Elif(phase.busy):
        m.d.sync += [cells.eq(cells >> 1), column.eq(column + 1), phase.busy.eq(column != columns - 1)]
    with m.If(phase.decide):
        m.d.sync += write.data.eq(switch.next_word)
        m.d.sync += rows.payload.cells.eq(Cat(rows.payload.cells, switch.next_pressed)[1:])
    with m.If(phase.finish):
        m.d.sync += [rows.valid.eq(1), rows.payload.last.eq(last)]
    with m.Elif(rows.ready):
        m.d.sync += rows.valid.eq(0)
    return last
