"""Which rows an adaptive scan drives next."""

from amaranth.hdl import Array, Const, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived

HITS = 2
"""Probes of a frame that may be followed by a search; where one more hits, the rest is scanned row by row."""


class Seek(wiring.Component):
    """Chooses row patterns; told at each ``strobe`` whether any column of the last one read pressed (``hit``).

    A slot drives one row ``alone``, or it *probes* several. A frame begins with a probe of all rows that are not on
    the list; where that hits, a search halves them (docs/timing.md). Rows are driven alone in ascending order. A row
    stays on the list while it hits, and while ``busy`` says at its strobe that it has to.

    ``known`` has the rows whose cells in this frame are known, one clock after the strobe; ``clear``, which must come
    before the next frame's first strobe, forgets them. ``ends`` is high in the clock behind a frame's last strobe. The
    other outputs are there ``Derived.choice_clocks`` behind the strobe and hold until the next; ``idle`` stands for a
    probe of all rows, ``first`` for the frame's first slot.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = Derived(skin)
        rows = skin.rows
        everything = (1 << rows) - 1
        super().__init__(
            {
                "strobe": In(1),
                "hit": In(1),
                "busy": In(1),
                "clear": In(1),
                "pattern": Out(rows, init=everything),
                "alone": Out(1),
                "idle": Out(1, init=1),
                "first": Out(1, init=1),
                "known": Out(rows),
                "ends": Out(1),
            }
        )

    def elaborate(self, platform):
        m = Module()
        rows, levels = self.skin.rows, self.derived.row_levels
        self._todo = Signal(rows)  # to be driven alone in this frame
        self._suspects = Signal(rows)  # one of them hit: searched, then driven alone, then the rows behind them
        self._open = Signal(rows)  # neither known nor to be driven alone
        self._level = Signal(range(max(2, levels)), init=levels - 1)  # of the search: the bit of the row number
        self._searching = Signal()
        self._suspected = Signal()  # the row that was just driven was a suspect
        self._hits = Signal(range(HITS + 1))
        self._spare = Signal(range(rows), init=rows - 2)  # probes this frame may still make
        m.d.comb += self._open.eq(~self.known & ~self._todo)
        with m.If(self.clear):
            m.d.sync += self.known.eq(0)
        self._keep_list(m)
        with m.FSM(name="choice"):
            with m.State("WAIT"):
                with m.If(self.strobe):
                    m.d.sync += self.first.eq(0)
                    self._learn(m)
            with m.State("SEARCH"):
                self._search(m)
            with m.State("PICK"):
                self._pick(m)
            with m.State("START"):
                self._start(m)
        return m

    def _keep_list(self, m):
        """Rows to be driven alone in the next frame, and how many."""
        self._list = Signal(self.skin.rows)
        self._listed = Signal(range(self.skin.rows + 1))
        with m.If(self.strobe & self.alone):
            was = (self._list & self.pattern).any()
            stays = self.hit | self.busy
            with m.If(stays):
                m.d.sync += self._list.eq(self._list | self.pattern)
            with m.Else():
                m.d.sync += self._list.eq(self._list & ~self.pattern)
            with m.If(stays & ~was):
                m.d.sync += self._listed.eq(self._listed + 1)
            with m.If(~stays & was):
                m.d.sync += self._listed.eq(self._listed - 1)

    def _learn(self, m):
        pattern = self.pattern
        m.d.sync += [self._suspected.eq(0), self.idle.eq(0)]
        with m.If(self.alone | ~self.hit):
            m.d.sync += self.known.eq(self.known | pattern)
        with m.If(self.alone):
            m.next = "PICK"
            suspected = (self._suspects & pattern).any()
            behind = Signal(self.skin.rows)
            with m.If(suspected & self.hit):
                m.d.comb += behind.eq((pattern << 1)[: self.skin.rows] & ~self.known)
            m.d.sync += [
                self._suspected.eq(suspected),
                self._suspects.eq(self._suspects & ~pattern | behind),
                self._todo.eq(self._todo & ~pattern | behind),
            ]
        with m.Elif(self._searching):
            m.next = "SEARCH"
            m.d.sync += [
                self._level.eq(self._level - 1),
                self._suspects.eq(Mux(self.hit, pattern, self._suspects & ~pattern)),
            ]
        with m.Elif(self.hit & (self._hits == HITS)):
            m.next = "PICK"
            m.d.sync += self._todo.eq(self._todo | pattern)
        with m.Elif(self.hit):
            m.next = "SEARCH"
            m.d.sync += [
                self._hits.eq(self._hits + 1),
                self._searching.eq(1),
                self._level.eq(self.derived.row_levels - 1),
                self._suspects.eq(pattern),
            ]
        with m.Else():
            m.next = "PICK"

    def _search(self, m):
        """Halve the suspects by a bit of their number. Rows that differ in the lowest alone are driven alone."""
        rows, levels = self.skin.rows, self.derived.row_levels
        lower = Array(Const(sum(1 << row for row in range(rows) if not row >> bit & 1), rows) for bit in range(levels))
        low, high = self._suspects & lower[self._level], self._suspects & ~lower[self._level]
        ends = self._level == 0
        with m.If(ends | low.any() & high.any() & (self._spare == 0)):
            m.next = "PICK"
            m.d.sync += [
                self._searching.eq(0),
                self._todo.eq(self._todo | Mux(ends, self._suspects, self._open)),
            ]
        with m.Elif(low.any() & high.any()):
            m.next = "WAIT"
            m.d.sync += [self.pattern.eq(low), self.alone.eq(0), self._spare.eq(self._spare - 1)]
        with m.Else():
            m.d.sync += self._level.eq(self._level - 1)

    def _pick(self, m):
        rest = self._suspected & (self._suspects == 0) & self._open.any()
        with m.If(rest & (self._spare == 0)):
            m.d.sync += [self._todo.eq(self._todo | self._open), self._suspected.eq(0)]
        with m.Elif(rest):
            m.next = "WAIT"
            m.d.sync += [self.pattern.eq(self._open), self.alone.eq(0), self._spare.eq(self._spare - 1)]
        with m.Elif(self._todo.any()):
            m.next = "WAIT"
            m.d.sync += [self.pattern.eq(self._todo & -self._todo), self.alone.eq(1)]
        with m.Else():
            m.next = "START"
            m.d.comb += self.ends.eq(1)

    def _start(self, m):
        rows = self.skin.rows
        m.d.sync += [
            self.first.eq(1),
            self.alone.eq(0),
            self._hits.eq(0),
            self._searching.eq(0),
            self._suspected.eq(0),
            self._suspects.eq(0),
        ]
        with m.If(self._listed >= rows - 1):  # probing a single row would be no less than driving it alone
            m.next = "PICK"
            m.d.sync += [self._todo.eq((1 << rows) - 1), self._spare.eq(0)]
        with m.Else():
            m.next = "WAIT"
            m.d.sync += [
                self._todo.eq(self._list),
                self._spare.eq(rows - 2 - self._listed),
                self.pattern.eq(~self._list),
                self.idle.eq(self._listed == 0),
            ]
