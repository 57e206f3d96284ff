"""A stack whose top is always available."""

from amaranth.hdl import Elaboratable, Module, Mux, Signal, Value
from amaranth.lib import data, memory

SHALLOW = 4
"""Depth up to which registers alone are smaller than a memory with a register on top."""


class Stack(Elaboratable):
    """Stack of ``depth`` entries whose top is a register; the others are in registers or, if many, in a memory.

    In one clock with ``enable`` the stack performs ``pop``, then ``push``. Depth 0 keeps nothing. The caller never pops
    an empty stack or pushes onto a full one.
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
        deeper = Signal()
        shallower = Signal()
        m.d.comb += [
            deeper.eq(self.enable & self.push & ~self.pop),
            shallower.eq(self.enable & self.pop & ~self.push),
        ]
        with m.If(deeper):
            m.d.sync += self.level.eq(self.level + 1)
        with m.If(shallower):
            m.d.sync += self.level.eq(self.level - 1)
        below = self._shift(m, deeper, shallower) if self.depth <= SHALLOW else self._spill(m, deeper, shallower)
        with m.If(shallower):
            m.d.sync += self.top.eq(below)
        with m.If(self.enable & self.push):
            m.d.sync += self.top.eq(self.entry)
        return m

    def _shift(self, m: Module, deeper: Value, shallower: Value) -> Value:
        entries = [self.top, *(Signal(self.entry.shape(), name=f"below_{i}") for i in range(1, self.depth))]
        for index in range(1, self.depth):
            with m.If(deeper):
                m.d.sync += entries[index].eq(entries[index - 1])
            if index + 1 < self.depth:
                with m.If(shallower):
                    m.d.sync += entries[index].eq(entries[index + 1])
        return entries[1] if self.depth > 1 else self.top

    def _spill(self, m: Module, deeper: Value, shallower: Value) -> Value:
        """Keep the entries below the top in a memory, entry i at address i; returns the one next to the top.

        That entry is read ahead, or, if just written, kept in a register: no address is read and written in the same
        clock.
        """
        m.submodules.below = below = memory.Memory(shape=self.entry.shape(), depth=self.depth - 1, init=[])
        write = below.write_port()
        read = below.read_port()
        copy = Signal(self.entry.shape())
        fresh = Signal()
        m.d.comb += [
            write.en.eq(deeper & (self.level != 0)),
            write.addr.eq(self.level - 1),
            write.data.eq(self.top),
            read.en.eq(shallower),
            read.addr.eq(self.level - 3),
        ]
        with m.If(deeper):
            m.d.sync += [copy.eq(self.top), fresh.eq(1)]
        with m.If(shallower):
            m.d.sync += fresh.eq(0)
        return Mux(fresh, copy, read.data)
