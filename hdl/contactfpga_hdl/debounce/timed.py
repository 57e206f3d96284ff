"""Debounce for a scan that waits: rows are sampled at uneven times, and delays are counted in us."""

from amaranth.hdl import Cat, Module, Mux, Signal, Value
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga_hdl.debounce.even import Phase, Switch, walk_columns
from contactfpga_hdl.payloads import row_layout


class TimedDebounce(wiring.Component):
    """Raw rows in, debounced rows out; a row that was driven takes C + 3 clocks, other rows none.

    Other rows are quiet: no cell reads pressed, and no switch counts as pressed or has a time running. After reset all
    rows are quiet.

    raw (in): a frame's rows in ascending order.
    alone (in): the offered row was driven.
    now (in): time of its sample.
    rows (out): debounced rows.
    busy (out): a bit per row that was not quiet after its last sample, from the row's offer on.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = skin.derived
        row = row_layout(self.derived)
        super().__init__(
            {
                "raw": In(stream.Signature(row)),
                "alone": In(1),
                "now": In(self.derived.tick_bits),
                "rows": Out(stream.Signature(row)),
                "busy": Out(skin.rows),
            }
        )

    def elaborate(self, platform):
        m = Module()
        m.submodules.walk = walk = _TimedWalk(self.skin)
        raw, rows = self.raw, self.rows
        row = Signal(range(self.skin.rows))  # of which one at most is inside
        passes = raw.valid & ~self.alone & walk.raw.ready
        enters = walk.raw.valid & walk.raw.ready
        now = Signal.like(self.now)  # kept, as the port goes on while a row is inside
        # Time and number of the row inside
        with m.If(enters):
            m.d.sync += now.eq(self.now)
        if self.derived.skips:
            with m.If(enters):
                m.d.sync += row.eq(raw.payload.y)
        else:
            with m.If(rows.valid & rows.ready):
                m.d.sync += row.eq(Mux(rows.payload.last, 0, row + 1))
        # Driven rows pass through the walk, others past it
        m.d.comb += [
            walk.raw.valid.eq(raw.valid & self.alone),
            walk.raw.payload.eq(raw.payload),
            walk.row.eq(row),
            walk.now.eq(now),
            walk.rows.ready.eq(rows.ready),
            raw.ready.eq(walk.raw.ready & (self.alone | rows.ready)),
            rows.valid.eq(walk.rows.valid | passes),
            rows.payload.eq(Mux(passes, raw.payload.as_value(), walk.rows.payload.as_value())),
            self.busy.eq(walk.busy),
        ]
        return m


class _TimedSwitch(Switch):
    """A switch's word: two bits of state, and the time of its beginning; all zero while quiet."""

    def __init__(self, m: Module, now: Value):
        bits = len(now)
        super().__init__(2 + bits)
        self.state, since = Mux(self.fresh, 0, self.word[:2]), self.word[2:]
        self.next_state = Signal(2)
        self.starts = Signal()  # a time begins
        self.elapsed = Signal(bits)
        m.d.comb += [
            self.elapsed.eq(now - since),
            self.next_word.eq(Mux(self.next_state == 0, 0, Cat(self.next_state, Mux(self.starts, now, since)))),
        ]


class _TimedWalk(wiring.Component):
    """:class:`~contactfpga_hdl.debounce.even.Debounce` for a ``row`` that was sampled ``now``."""

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = skin.derived
        row = row_layout(self.derived)
        super().__init__(
            {
                "raw": In(stream.Signature(row)),
                "rows": Out(stream.Signature(row)),
                "row": In(range(skin.rows)),
                "now": In(self.derived.tick_bits),
                "busy": Out(skin.rows),
            }
        )

    def elaborate(self, platform):
        m = Module()
        switch, phase = _TimedSwitch(m, self.now), Phase()
        if self.skin.debounce == "sym_defer_pk":
            _defer_both(m, switch, self.derived.press_ticks, self.derived.release_ticks)
        else:
            _eager_press(m, switch, self.derived.press_ticks, self.derived.release_ticks)
        walk_columns(m, self.skin, self.raw, self.rows, self.row, switch, phase)
        # All words of a quiet row are 0, whatever the memory holds since before a reset. The row is the same from a
        # clock before the first word on.
        m.d.sync += switch.fresh.eq(~self.busy.bit_select(self.row, 1))
        kept = Signal()  # a switch so far was not quiet
        with m.If(phase.decide):
            m.d.sync += kept.eq(kept | (switch.next_word != 0))
        with m.If(phase.finish):
            m.d.sync += [kept.eq(0), self.busy.bit_select(self.row, 1).eq(kept)]
            if self.derived.skips:
                m.d.sync += self.rows.payload.y.eq(self.row)
        return m


def _defer_both(m: Module, switch: _TimedSwitch, press: int, release: int) -> None:
    """State: whether the switch counts as pressed, and whether its reading has differed since."""
    pressed, differed = switch.state
    differs = switch.raw ^ pressed
    time = Mux(pressed, release, press)
    changes = differs & Mux(differed, switch.elapsed >= time, time == 0)
    m.d.comb += [
        switch.starts.eq(~differed),
        switch.next_pressed.eq(pressed ^ changes),
        switch.next_state.eq(Cat(switch.next_pressed, differs & ~changes)),
    ]


def _eager_press(m: Module, switch: _TimedSwitch, press: int, release: int) -> None:
    """States: released; pressed with readings ignored; pressed; reads released since."""
    with m.Switch(switch.state):
        with m.Case(0):
            m.d.comb += [switch.starts.eq(1), switch.next_state.eq(Mux(switch.raw, 1 if press else 2, 0))]
        with m.Case(1):
            with m.If(switch.elapsed < press):
                m.d.comb += switch.next_state.eq(1)
            with m.Else():
                _hold(m, switch, release)
        with m.Case(2):
            _hold(m, switch, release)
        with m.Case(3):
            m.d.comb += switch.next_state.eq(Mux(switch.raw, 2, Mux(switch.elapsed >= release, 0, 3)))
    m.d.comb += switch.next_pressed.eq(switch.next_state != 0)


def _hold(m: Module, switch: _TimedSwitch, release: int) -> None:
    m.d.comb += [switch.starts.eq(1), switch.next_state.eq(Mux(switch.raw, 2, 3 if release else 0))]
