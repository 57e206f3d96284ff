"""Two copies of the gateware, compared in each clock."""

from amaranth.hdl import Cat, Module, ResetInserter, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import Out

from contactfpga.skin import Skin

PAUSE_BITS = 16
"""Bits for which the line is broken, and then for which the line rests: more than a byte."""


class Dual(wiring.Component):
    """The gateware ``first``, as long as ``second`` gives the same a clock later.

    ``second`` starts and gets each input a clock later, so that no two registers are equal by construction and merged
    in synthesis. The outputs are those of ``first`` in the same clock; ``contact`` with ``fail_safe`` comes a clock
    later, as copies give it without a register. From at most two clocks after the first difference ``tx`` is low for
    longer than a byte, so that the packet on the line ends without its check. Then ``tx`` rests, both copies start from
    reset, and the host sees a restarted board. With ``fail_safe`` ``contact`` is high from the difference until a scan
    after the restart.

    The only state here is the restart's counter, which always ends, and the register at ``contact``, written every
    clock.

    first (component): may have probes, which are passed on.
    second (component): the same without probes.
    """

    def __init__(self, skin: Skin, first: wiring.Component, second: wiring.Component):
        self.skin = skin
        self.first, self.second = first, second
        super().__init__(dict(first.signature.members))

    def elaborate(self, platform):
        m = Module()
        differs = Signal()
        breaks = Signal()
        holds = Signal()
        holds_second = Signal(init=1)
        # Copies, the second a clock behind
        m.submodules.first = ResetInserter(holds)(self.first)
        m.submodules.second = ResetInserter(holds_second)(self.second)
        self._connect(m)
        m.d.comb += differs.eq(self._compare(m) & ~holds_second)
        m.d.sync += holds_second.eq(holds)
        # Restart: the line breaks off, then rests, and both copies are held
        pause = PAUSE_BITS * self.skin.derived.bit_clocks
        scan = self.skin.derived.frame_clocks
        left = Signal(range(scan + 2 * pause + 1))  # of the restart, in clocks
        with m.If(differs):
            m.d.sync += left.eq(scan + 2 * pause)
        with m.Elif(left != 0):
            m.d.sync += left.eq(left - 1)
        m.d.sync += [
            breaks.eq(differs | (left > scan + pause)),
            holds.eq(differs | (left > scan)),
        ]
        restarts = differs | (left != 0)
        # Outputs
        m.d.comb += self.tx.eq(self.first.tx & ~breaks)
        if self.skin.fail_safe:
            m.d.sync += self.contact.eq(self.first.contact | restarts)
        return m

    def _connect(self, m: Module) -> None:
        special = {"tx", "contact"} if self.skin.fail_safe else {"tx"}
        for name, member in self.signature.members.items():
            outside, inside = getattr(self, name), getattr(self.first, name)
            if member.flow == Out:
                if name not in special:
                    m.d.comb += outside.eq(inside)
                continue
            later = Signal.like(outside, name=f"{name}_later", init=member.init or 0)
            m.d.sync += later.eq(outside)
            m.d.comb += [inside.eq(outside), getattr(self.second, name).eq(later)]

    def _compare(self, m: Module) -> Value:
        names = [name for name, member in self.second.signature.members.items() if member.flow == Out]
        said = Cat(getattr(self.first, name) for name in names)
        before = Signal(len(said))
        m.d.sync += before.eq(said)
        return before != Cat(getattr(self.second, name) for name in names)
