"""A clock from the FPGA's PLL."""

from amaranth.hdl import (
    ClockDomain,
    ClockSignal,
    DomainRenamer,
    Elaboratable,
    Instance,
    Module,
    ResetSignal,
    Signal,
    Value,
)
from amaranth.lib import io, wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out

from contactfpga.boards import pll
from contactfpga.boards.spec import BoardSpec

RESET_US = 15
"""Reset after the PLL's lock: five times the 3 us in which an iCE40's block RAMs are unreadable, as in Amaranth's reset
for a crystal."""


class HeldReset(wiring.Component):
    """Reset at power-up and until the asynchronous ``locked`` has been high for ``clocks`` and two synchronizer clocks.
    A lost lock restarts it."""

    def __init__(self, clocks: int):
        self.clocks = clocks
        super().__init__({"locked": In(1), "reset": Out(1)})

    def elaborate(self, platform):
        m = Module()
        steady = Signal()
        timer = Signal(range(self.clocks + 1))
        ready = Signal()  # flip-flops of an iCE40 are zero at power-up, whatever their initial value
        m.submodules.sync_locked = FFSynchronizer(self.locked, steady)
        m.d.comb += self.reset.eq(~ready)
        m.d.sync += ready.eq(steady & (timer == self.clocks))
        with m.If(~steady):
            m.d.sync += timer.eq(0)
        with m.Elif(timer != self.clocks):
            m.d.sync += timer.eq(timer + 1)
        return m


class PllClock(Elaboratable):
    """Drives the domain ``sync``, which is defined around it, at ``clock_hz``; in reset until :data:`RESET_US` after
    the PLL's lock."""

    def __init__(self, board: BoardSpec, clock_hz: int):
        self.board = board
        self.clock_hz = clock_hz
        self.dividers = pll.dividers(board.pll, board.clock_hz, clock_hz)

    def elaborate(self, platform):
        m = Module()
        crystal = platform.request(platform.default_clk, dir="-")
        clock = Signal()
        locked = Signal()
        if self.board.pll == "SB_PLL40_PAD":
            m.submodules.pll = self._ice40(clock, locked, i_PACKAGEPIN=crystal.io)
        else:
            m.submodules.pin = pin = io.Buffer("i", crystal)
            make = self._ecp5 if self.board.pll == "EHXPLLL" else self._ice40
            reference = "i_CLKI" if self.board.pll == "EHXPLLL" else "i_REFERENCECLK"
            m.submodules.pll = make(clock, locked, **{reference: pin.i})
        m.domains += ClockDomain("por", reset_less=True, local=True)
        m.submodules.reset = reset = DomainRenamer("por")(HeldReset(RESET_US * self.clock_hz // pll.MHZ))
        m.d.comb += [
            ClockSignal("por").eq(clock),
            ClockSignal("sync").eq(clock),
            reset.locked.eq(locked),
            ResetSignal("sync").eq(reset.reset),
        ]
        return m

    def _ice40(self, clock: Signal, locked: Signal, **reference: Value) -> Instance:
        return Instance(
            self.board.pll,
            p_FEEDBACK_PATH="SIMPLE",
            **{f"p_{name}": value for name, value in self.dividers.items()},
            i_RESETB=1,
            i_BYPASS=0,
            o_PLLOUTGLOBAL=clock,
            o_LOCK=locked,
            **reference,
        )

    def _ecp5(self, clock: Signal, locked: Signal, **reference: Value) -> Instance:
        return Instance(
            self.board.pll,
            # The loop filter as Project Trellis' calculator sets it for every frequency.
            a_ICP_CURRENT="12",
            a_LPF_RESISTOR="8",
            a_MFG_ENABLE_FILTEROPAMP="1",
            a_MFG_GMCREF_SEL="2",
            p_FEEDBK_PATH="CLKOP",
            p_CLKOP_ENABLE="ENABLED",
            p_CLKOP_CPHASE=self.dividers["CLKOP_DIV"] // 2,
            **{f"p_{name}": value for name, value in self.dividers.items()},
            **{f"i_{name}": 0 for name in ("RST", "STDBY", "PLLWAKESYNC", "ENCLKOP", "PHASESEL0", "PHASESEL1")},
            **{f"i_{name}": 1 for name in ("PHASEDIR", "PHASESTEP", "PHASELOADREG")},  # inactive
            i_CLKFB=clock,
            o_CLKOP=clock,
            o_LOCK=locked,
            **reference,
        )
