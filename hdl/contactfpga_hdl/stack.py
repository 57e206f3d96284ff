"""A stack whose top is always at hand."""

from amaranth.hdl import Elaboratable, Module, Signal
from amaranth.lib import data, memory


class Stack(Elaboratable):
    """Stack of ``depth`` entries: the top in a register, the others in a memory that can be block RAM.

    In one cycle it takes ``pop``, then ``push``; with ``enable`` low it does nothing. Depth 0 keeps nothing.
    Popping an empty stack and pushing onto a full one are the caller's errors.
    """

    def __init__(self, layout: data.StructLayout, depth: int):
        self.depth = depth
        self.enable = Signal(init=1)
        self.push = Signal()
        self.pop = Signal()
        self.entry = Signal(layout)
        self.top = Signal(layout)
        self.level = Signal(range(depth + 1))

    def elaborate(self, platform):
        m = Module()
        if self.depth == 0:
            return m
        with m.If(self.enable & self.push):
            m.d.sync += self.top.eq(self.entry)
        with m.If(self.enable):
            m.d.sync += self.level.eq(self.level + self.push - self.pop)
        if self.depth > 1:
            self._spill(m)
        return m

    def _spill(self, m):
        """Entries below the top: entry i of the stack lies at address i."""
        m.submodules.below = below = memory.Memory(shape=self.entry.shape(), depth=self.depth - 1, init=[])
        write = below.write_port()
        read = below.read_port(transparent_for=(write,))
        level = Signal.like(self.level)
        m.d.comb += [
            level.eq(self.level + self.push - self.pop),
            write.en.eq(self.enable & self.push & ~self.pop & (self.level != 0)),
            write.addr.eq(self.level - 1),
            write.data.eq(self.top),
            read.en.eq(self.enable),
            read.addr.eq(level - 2),
        ]
        with m.If(self.enable & self.pop & ~self.push):
            m.d.sync += self.top.eq(read.data)
