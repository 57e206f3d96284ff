"""Contact bounce where rows are not sampled at even times: delays are counted in row times."""

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga_hdl.debounce.even import Debounce
from contactfpga_hdl.payloads import row_layout


class TimedDebounce(wiring.Component):
    """Raw rows in, debounced rows out; a row that was driven ``alone`` takes C + 3 clocks, others none.

    Others are quiet: no cell reads pressed and no switch counts so or has a time running. ``now`` is the row time in
    which a row that was driven alone was sampled; it must hold for 4 clocks more than there are columns. ``busy`` has
    the rows that were not quiet behind their last sample, as soon as such a row is offered.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = Derived(skin)
        row = row_layout(self.derived)
        super().__init__(
            {
                "raw": In(stream.Signature(row)),
                "alone": In(1),
                "now": In(self.derived.slot_bits),
                "rows": Out(stream.Signature(row)),
                "busy": Out(skin.rows),
            }
        )

    def elaborate(self, platform):
        m = Module()
        m.submodules.walk = walk = _Walk(self.skin)
        raw, rows = self.raw, self.rows
        row = Signal(range(self.skin.rows))  # of which one at most is inside
        passes = raw.valid & ~self.alone & walk.raw.ready
        m.d.comb += [
            walk.raw.valid.eq(raw.valid & self.alone),
            walk.raw.payload.eq(raw.payload),
            walk.row.eq(row),
            walk.now.eq(self.now),
            walk.rows.ready.eq(rows.ready),
            raw.ready.eq(walk.raw.ready & (self.alone | rows.ready)),
            rows.valid.eq(walk.rows.valid | passes),
            rows.payload.eq(Mux(passes, raw.payload.as_value(), walk.rows.payload.as_value())),
            self.busy.eq(walk.busy),
        ]
        with m.If(rows.valid & rows.ready):
            m.d.sync += row.eq(Mux(rows.payload.last, 0, row + 1))
        return m


class _Walk(Debounce):
    """Each switch's word: two bits of state, and the row time since when it is in it; all zero while it is quiet."""

    def _ports(self):
        more = {"row": In(range(self.skin.rows)), "now": In(self.derived.slot_bits), "busy": Out(self.skin.rows)}
        return super()._ports() | more

    def elaborate(self, platform):
        m = Module()
        bits = self.derived.slot_bits
        self._raw = Signal()
        self._word = Signal(2 + bits)
        self._next_word = Signal.like(self._word)
        self._next_pressed = Signal()
        self._row = self.row
        self._state, self._next_state = self._word[:2], Signal(2)
        since = self._word[2:]
        self._starts = Signal()  # a time begins
        self._elapsed = Signal(bits)
        m.d.comb += [
            self._elapsed.eq(self.now - since),
            self._next_word.eq(
                Mux(self._next_state == 0, 0, Cat(self._next_state, Mux(self._starts, self.now, since)))
            ),
        ]
        if self.skin.debounce == "sym_defer_pk":
            self._defer_both(m, self.derived.press_slots, self.derived.release_slots)
        else:
            self._eager_press(m, self.derived.press_slots, self.derived.release_slots)
        self._walk_columns(m)
        self._note_busy(m)
        return m

    def _defer_both(self, m, press, release):
        """State: whether it counts as pressed, and whether it has differed since."""
        pressed, differed = self._state
        differs = self._raw ^ pressed
        time = Mux(pressed, release, press)
        changes = differs & Mux(differed, self._elapsed >= time, time == 0)
        m.d.comb += [
            self._starts.eq(~differed),
            self._next_pressed.eq(pressed ^ changes),
            self._next_state.eq(Cat(self._next_pressed, differs & ~changes)),
        ]

    def _eager_press(self, m, press, release):
        """States: released; pressed and whatever it reads is ignored; pressed; reads released since."""
        with m.Switch(self._state):
            with m.Case(0):
                m.d.comb += [self._starts.eq(1), self._next_state.eq(Mux(self._raw, 1 if press else 2, 0))]
            with m.Case(1):
                with m.If(self._elapsed < press):
                    m.d.comb += self._next_state.eq(1)
                with m.Else():
                    self._hold(m, release)
            with m.Case(2):
                self._hold(m, release)
            with m.Case(3):
                m.d.comb += self._next_state.eq(Mux(self._raw, 2, Mux(self._elapsed >= release, 0, 3)))
        m.d.comb += self._next_pressed.eq(self._next_state != 0)

    def _hold(self, m, release):
        m.d.comb += [self._starts.eq(1), self._next_state.eq(Mux(self._raw, 2, 3 if release else 0))]

    def _note_busy(self, m):
        kept = Signal()
        with m.If(self._decide):
            m.d.sync += kept.eq(kept | (self._next_word != 0))
        with m.If(self._finish):
            m.d.sync += [kept.eq(0), self.busy.bit_select(self._row, 1).eq(kept)]
