"""Line reversal: the states that share the sheet. Pins follow a state by a clock."""

from amaranth.hdl import Const, Module, Mux, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga_hdl.payloads import row_bits
from contactfpga_hdl.scan.pins import moves_sample, sample_at_ports
from contactfpga_hdl.scan.sample_at import SampleAt
from contactfpga_hdl.util.bits import lowest

SYNCHRONIZED = 3
"""Clocks from a touch until its row reads touched at a synchronizer's output, inclusive."""


class ReversalCycle(wiring.Component):
    """Sequence of listening, and of charge, gap and select for each row; with ``guard`` also checks, with ``self_test``
    tests.

    touched (in): rows to drive: they read touched, or have a debounce time running.
    wanted (in): a frame is wanted without a touch.
    packed (in): pulse when the last begun frame is packed.
    offers (in): a row is on offer.
    begins (out): pulse when a frame begins, with the rows that read touched then.
    rests (out): rows are watched, and no frame has begun since.
    settled (out): rows have been released for long enough.
    todo (out): rows still to be driven in this frame.
    y, following (out): number of the last driven row, and of the next one.
    strobe (out): pulse when the columns of row ``y`` are available.
    charges, listens (out): in the next clock columns are driven; rows are released.
    selected (out): rows driven to the selecting level.

    With ``guard``, see :class:`~contactfpga_hdl.scan.reversal_guard.Checks`:

    check_asked (in): a check of a resting sheet is wanted.
    of_rows (in): the next check is of the rows.
    check_starts, checked (out): pulses when a check starts, and when its sample is available.
    guard (out): the guard row is driven to the selecting level.
    inverts (out): in the next clock the guard column has the released level, other columns the selecting level.

    With ``self_test``, see :class:`~contactfpga_hdl.scan.self_test.SelfTest`:

    test_asked (in): a slot is wanted.
    tested (in): pulse in a slot's last clock.
    discharges (in): in the next clock all rows are driven to the selecting level.
    lets_go (out): pulse when a slot begins.
    tests (out): a slot is under way.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = derived = skin.derived
        self._settle = settle = derived.settle_clocks
        self._charge = charge = derived.release_clocks - 2
        # Columns are driven as a frame begins, and a clock more; of a charge there is as much by then.
        self._listened = derived.project_clocks + SYNCHRONIZED
        self._charged = min(charge - 1, charge - derived.precharge_clocks + self._listened)
        self._clock = Signal(
            range(max(self._listened, settle + 1, charge)), name="clock"
        )  # how long a state has lasted
        self._due = Signal(2, name="due")  # a sample on its way through the synchronizer
        self._checked = Signal(2, name="checks_due")  # that of a check
        self._selects = Signal(name="selects")  # the guard row is driven next, or is
        self._underway = Signal(name="underway")  # a frame has begun and is not packed
        y = row_bits(derived)
        inputs = ("wanted", "packed", "offers", "check_asked", "of_rows", "test_asked", "tested", "discharges")
        outputs = ("begins", "rests", "settled", "strobe", "charges", "listens", "check_starts", "checked", "guard")
        super().__init__(
            {
                "touched": In(skin.rows),
                **dict.fromkeys(inputs, In(1)),
                **dict.fromkeys((*outputs, "inverts", "lets_go", "tests"), Out(1)),
                "todo": Out(skin.rows),
                "selected": Out(skin.rows),
                "y": Out(y),
                "following": Out(y),
                **sample_at_ports(derived),
            }
        )

    def elaborate(self, platform):
        m = Module()
        waits = Signal()  # a row is on its way, or on offer
        # Rows to be driven, samples on their way, and the clock of the state
        m.d.comb += [
            self.following.eq(lowest(self.todo)[: len(self.y)]),
            self.strobe.eq(self._due[-1]),
            self.checked.eq(self._checked[-1]),
            waits.eq(self._due.any() | self.offers),
        ]
        m.d.sync += [
            self._clock.eq(self._clock + 1),
            self._due.eq(self._due << 1),
            self._checked.eq(self._checked << 1),
            self._underway.eq((self._underway | self.begins) & ~self.packed),
            self.todo.eq(Mux(self.begins, self.touched, self.todo & ~self.selected)),
            self.selected.eq(0),
            self.guard.eq(0),
        ]
        # States; LISTEN also begins frames
        sample_clock = self._sample_clock(m)
        with m.FSM(name="cycle"):
            with m.State("LISTEN"):
                self._listen(m)
            with m.State("CHARGE"):
                m.d.comb += self.charges.eq(1)
                with m.If(self._clock == self._charge - 1):
                    m.d.sync += self._clock.eq(self._clock)
                    with m.If(~waits | self._selects):
                        m.next = "GAP"
            with m.State("GAP"):
                m.d.sync += self._clock.eq(0)
                with m.If(~self._selects):
                    m.d.sync += self.y.eq(self.following)
                m.next = "SELECT"
            with m.State("SELECT"):
                self._select(m, sample_clock)
            if self.skin.guard:
                self._answer(m)
            if self.skin.self_test:
                self._test(m)
        # Discharge before a slot of the self-test
        if self.skin.self_test:
            with m.If(self.discharges):
                m.d.sync += [self.selected.eq(-1), self.guard.eq(1)]
        return m

    def _listen(self, m: Module) -> None:
        touched = self.touched.any()
        m.d.comb += [self.charges.eq(1), self.listens.eq(1), self.settled.eq(self._clock == self._listened - 1)]
        with m.If(self.settled):
            m.d.sync += self._clock.eq(self._clock)
            with m.If(self.rests & touched):  # others may be about to be
                m.d.sync += [self.rests.eq(0), self._clock.eq(SYNCHRONIZED)]
            if self.skin.self_test:
                with m.Elif(self.test_asked & ~self._underway):
                    m.d.comb += self.lets_go.eq(1)
                    m.next = "TEST"
            if self.skin.guard:
                with m.Elif(self.rests & self.check_asked):
                    m.d.sync += self._clock.eq(self._check_clocks - self._settle)  # rows need not fall first
                    self._check(m, columns_from="GAP")
            with m.Elif(~self._underway & (~self.rests | self.wanted)):
                m.d.comb += self.begins.eq(1)
                m.d.sync += self.rests.eq(~touched)
                with m.If(touched):
                    m.d.sync += self._clock.eq(self._charged)
                    m.next = "CHARGE"

    def _select(self, m: Module, sample_clock: Value | int) -> None:
        row = Const(1, self.skin.rows) << self.y
        m.d.sync += [self.selected.eq(Mux(self._selects, 0, row)), self.guard.eq(self._selects)]
        with m.If(self._clock == sample_clock):
            m.d.sync += self._due[0].eq(~self._selects)
        with m.If(self._clock == self._settle):
            m.d.sync += [self.selected.eq(0), self.guard.eq(0), self._clock.eq(0)]
            m.d.sync += self._checked[0].eq(self._selects)
            with m.If(self.todo.any()):
                m.next = "CHARGE"
            with m.Else():
                m.next = "LISTEN"
                if self.skin.guard:
                    m.d.sync += self._selects.eq(0)
                    with m.If(~self._selects):
                        self._check(m, columns_from="CHARGE")

    def _sample_clock(self, m: Module) -> Value | int:
        if not moves_sample(self.derived):
            return self._settle
        return SampleAt(m, self.derived, self.moves, self.clocks, self.begins).clock

    @property
    def _check_clocks(self) -> int:
        return max(self.derived.project_clocks, self._settle)

    def _check(self, m: Module, columns_from: str) -> None:
        m.d.comb += self.check_starts.eq(1)
        m.d.sync += self._selects.eq(~self.of_rows)
        with m.If(self.of_rows):
            m.next = "ANSWER"
        with m.Else():
            m.next = columns_from

    def _answer(self, m: Module) -> None:
        with m.State("ANSWER"):
            m.d.comb += [self.charges.eq(1), self.listens.eq(1), self.inverts.eq(1)]
            with m.If(self._clock == self._check_clocks):
                m.d.sync += [self._clock.eq(0), self._checked[0].eq(1)]
                m.next = "LISTEN"

    def _test(self, m: Module) -> None:
        with m.State("TEST"):
            m.d.comb += [self.listens.eq(1), self.tests.eq(1)]
            with m.If(self.tested):
                m.d.sync += self._clock.eq(0)
                m.next = "LISTEN"
