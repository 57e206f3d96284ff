"""A receive pin and what is read of requests there, in the simulator."""

from amaranth.hdl import Elaboratable, Module
from amaranth.lib import wiring

from contactfpga_hdl.link.request import RequestReader

IDLE = 5
"""Cycles before the first byte."""


class Listener(Elaboratable):
    """A receiver, and the reader of what it receives."""

    def __init__(self, receiver, commands=False):
        self.receiver, self.reader = receiver, RequestReader(commands)

    def elaborate(self, platform):
        m = Module()
        m.submodules += [self.receiver, self.reader]
        wiring.connect(m, self.receiver.bits, self.reader.bits)
        return m

    def receive(self, sim, levels):
        """Drives the receive pin: idle, then these levels, then idle. Returns the cycles until all of it is read."""
        levels = [1] * IDLE + levels
        sim.drive(self.receiver.pin, lambda cycle: levels[cycle] if cycle < len(levels) else 1)
        return len(levels) + 12

    def listen(self, sim, levels):
        """Requests (cycle, number, hello) in these levels, and the number in each cycle."""
        cycles = self.receive(sim, levels)
        ports = (self.reader.received, self.reader.hello, self.reader.heard, self.reader.number)
        received, hello, low, number = map(sim.watch, ports)
        sim.run(cycles)
        found = [(at, number[at + 1], bool(hello[at])) for at, taken in enumerate(received.values) if taken]
        assert all(low[at + 1] == number[at + 1] % 8 for at, _, _ in found)
        return found, number.values


def give_bits(sim, bits, events):
    """Drives what a receiver tells of bits: (level, bit, index, good, bad) a cycle, and two cycles of rest."""
    events = [*events, (1, 0, 0, 0, 0), (1, 0, 0, 0, 0)]
    for place, name in enumerate(("level", "bit", "index", "good", "bad")):
        sim.drive(getattr(bits, name), lambda cycle, place=place: events[min(cycle, len(events) - 1)][place])
    return len(events)
