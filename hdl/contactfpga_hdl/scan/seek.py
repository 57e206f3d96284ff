"""Selection of the rows that an adaptive scan drives next."""

from amaranth.hdl import Array, Const, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived

HITS = 2
"""Most probes of a frame that hit and begin a search; after one more hit, the remaining rows are scanned one by one."""


class _Plan:
    def __init__(self, derived: Derived):
        rows, levels = derived.skin.rows, derived.row_levels
        self.on_list = Signal(rows)  # to be driven alone in the next frame
        self.listed = Signal(range(rows + 1))  # how many
        self.todo = Signal(rows)  # to be driven alone in this frame
        self.suspects = Signal(rows)  # one of them hit: searched, then driven alone, then the rows after them
        self.open = Signal(rows)  # neither known nor to be driven alone
        self.level = Signal(range(max(2, levels)), init=levels - 1)  # of the search: the bit of the row number
        self.searching = Signal()
        self.suspected = Signal()  # the row that was just driven was a suspect
        self.hits = Signal(range(HITS + 1))
        self.spare = Signal(range(rows), init=rows - 2)  # probes this frame may still make


class Seek(wiring.Component):
    """Chooses the rows of each slot by whether the last ones hit.

    A slot drives one row alone, or it *probes* several. A frame begins with a probe of all rows that are not on the
    list; if that hits, a search halves them (docs/timing.md). Rows are driven alone in ascending order. A row stays on
    the list while it hits, or while ``busy``. Outputs except ``known`` and ``ends`` are valid from
    ``Derived.choice_clocks`` after the strobe until the next one.

    strobe (in): pulse at the end of a slot.
    hit (in): in that clock, whether any column read pressed.
    busy (in): in that clock, whether the row driven alone must stay on the list.
    clear (in): clears ``known`` before the next frame's first strobe.
    pattern (out): rows of the next slot.
    alone (out): the slot is one row, not a probe.
    idle (out): the slot is a probe of all rows.
    first (out): the slot is the frame's first.
    known (out): rows whose cells in this frame are known, one clock after the strobe.
    ends (out): pulse in the clock after a frame's last strobe.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = skin.derived
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
        plan = _Plan(self.derived)
        m.d.comb += plan.open.eq(~self.known & ~plan.todo)
        with m.If(self.clear):
            m.d.sync += self.known.eq(0)
        self._keep_list(m, plan)
        with m.FSM(name="choice"):
            with m.State("WAIT"):
                with m.If(self.strobe):
                    m.d.sync += self.first.eq(0)
                    self._learn(m, plan)
            with m.State("SEARCH"):
                self._search(m, plan)
            with m.State("PICK"):
                self._pick(m, plan)
            with m.State("START"):
                self._start(m, plan)
        return m

    def _keep_list(self, m: Module, plan: _Plan) -> None:
        with m.If(self.strobe & self.alone):
            was = (plan.on_list & self.pattern).any()
            stays = self.hit | self.busy
            with m.If(stays):
                m.d.sync += plan.on_list.eq(plan.on_list | self.pattern)
            with m.Else():
                m.d.sync += plan.on_list.eq(plan.on_list & ~self.pattern)
            with m.If(stays & ~was):
                m.d.sync += plan.listed.eq(plan.listed + 1)
            with m.If(~stays & was):
                m.d.sync += plan.listed.eq(plan.listed - 1)

    def _learn(self, m: Module, plan: _Plan) -> None:
        pattern = self.pattern
        m.d.sync += [plan.suspected.eq(0), self.idle.eq(0)]
        with m.If(self.alone | ~self.hit):
            m.d.sync += self.known.eq(self.known | pattern)
        with m.If(self.alone):
            m.next = "PICK"
            suspected = (plan.suspects & pattern).any()
            after = Signal(self.skin.rows)
            with m.If(suspected & self.hit):
                m.d.comb += after.eq((pattern << 1)[: self.skin.rows] & ~self.known)
            m.d.sync += [
                plan.suspected.eq(suspected),
                plan.suspects.eq(plan.suspects & ~pattern | after),
                plan.todo.eq(plan.todo & ~pattern | after),
            ]
        with m.Elif(plan.searching):
            m.next = "SEARCH"
            m.d.sync += [
                plan.level.eq(plan.level - 1),
                plan.suspects.eq(Mux(self.hit, pattern, plan.suspects & ~pattern)),
            ]
        with m.Elif(self.hit & (plan.hits == HITS)):
            m.next = "PICK"
            m.d.sync += plan.todo.eq(plan.todo | pattern)
        with m.Elif(self.hit):
            m.next = "SEARCH"
            m.d.sync += [
                plan.hits.eq(plan.hits + 1),
                plan.searching.eq(1),
                plan.level.eq(self.derived.row_levels - 1),
                plan.suspects.eq(pattern),
            ]
        with m.Else():
            m.next = "PICK"

    def _search(self, m: Module, plan: _Plan) -> None:
        """Halve the suspects by a bit of their number; rows that differ only in the lowest bit are driven alone.

        When no probe is left, all open rows are driven alone. The suspects are the first of them, so nothing is lost.
        """
        rows, levels = self.skin.rows, self.derived.row_levels
        lower = Array(Const(sum(1 << row for row in range(rows) if not row >> bit & 1), rows) for bit in range(levels))
        low, high = plan.suspects & lower[plan.level], plan.suspects & ~lower[plan.level]
        ends = plan.level == 0
        with m.If(ends | (plan.spare == 0)):
            m.next = "PICK"
            m.d.sync += [
                plan.searching.eq(0),
                plan.todo.eq(plan.todo | Mux(ends, plan.suspects, plan.open)),
            ]
        with m.Elif(low.any() & high.any()):
            m.next = "WAIT"
            m.d.sync += [self.pattern.eq(low), self.alone.eq(0), plan.spare.eq(plan.spare - 1)]
        with m.Else():
            m.d.sync += plan.level.eq(plan.level - 1)

    def _pick(self, m: Module, plan: _Plan) -> None:
        rest = plan.suspected & (plan.suspects == 0) & plan.open.any()
        with m.If(rest & (plan.spare == 0)):
            m.d.sync += [plan.todo.eq(plan.todo | plan.open), plan.suspected.eq(0)]
        with m.Elif(rest):
            m.next = "WAIT"
            m.d.sync += [self.pattern.eq(plan.open), self.alone.eq(0), plan.spare.eq(plan.spare - 1)]
        with m.Elif(plan.todo.any()):
            m.next = "WAIT"
            m.d.sync += [self.pattern.eq(plan.todo & -plan.todo), self.alone.eq(1)]
        with m.Else():
            m.next = "START"
            m.d.comb += self.ends.eq(1)

    def _start(self, m: Module, plan: _Plan) -> None:
        rows = self.skin.rows
        m.d.sync += [
            self.first.eq(1),
            self.alone.eq(0),
            plan.hits.eq(0),
            plan.searching.eq(0),
            plan.suspected.eq(0),
            plan.suspects.eq(0),
        ]
        with m.If(plan.listed >= rows - 1):  # probing a single row would be no less than driving it alone
            m.next = "PICK"
            m.d.sync += [plan.todo.eq((1 << rows) - 1), plan.spare.eq(0)]
        with m.Else():
            m.next = "WAIT"
            m.d.sync += [
                plan.todo.eq(plan.on_list),
                plan.spare.eq(rows - 2 - plan.listed),
                self.pattern.eq(~plan.on_list),
                self.idle.eq(plan.listed == 0),
            ]
