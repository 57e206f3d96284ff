"""Packets of some Skins between frames: fault reports, and readings of units (docs/protocol.md).

A hello goes first, then a report, then a frame, but a frame that waits is next after a report. Readings go when nothing
else waits, and at the latest after :data:`FRAMES_BEFORE_UNITS` frames, so that frames cannot hold them up.
"""

from typing import Protocol

from amaranth.hdl import Module, Signal, Value
from amaranth.lib import wiring

from contactfpga.wire.units import plain_bytes
from contactfpga_hdl.link.faults import Reporter

FRAMES_BEFORE_UNITS = 4
"""Frames sent in a row while unit readings wait."""


class Wire(Protocol):
    """The link's packet on the wire, and its choice of the next one."""

    idle: Signal
    take_hello: Signal
    take_frame: Signal
    take_report: Signal
    take_units: Signal
    offset: Signal
    fetches: Signal


class Reports:
    """Fault reports, and slots of a self-test, among a link's packets.

    sent: whether the last packet taken is one of these.
    byte: offered byte.
    """

    def __init__(self, m: Module, link: wiring.Component, wire: Wire):
        self._wire = wire
        self._grant = None if link.place is None else link.grant
        self.sent = Signal(name="is_report")
        m.submodules.reporter = self._reporter = reporter = Reporter(link.skin)
        self.byte = reporter.byte
        m.d.comb += [
            reporter.word.eq(link.faults),
            reporter.greeted.eq(wire.take_hello),
            reporter.taken.eq(wire.take_report),
            reporter.sends.eq(self.sent & ~wire.idle),
            reporter.place.eq(wire.offset),
            reporter.fetches.eq(wire.fetches),
        ]
        if link.skin.self_test:
            wiring.connect(m, wiring.flipped(link.slots), reporter.slots)

    def choose(self, m: Module, hello_due: Value, frame_waits: Value) -> Value:
        """Whether a report is next, while the wire is idle."""
        taken = self._wire.take_report
        due = self._reporter.due & ~hello_due & ~(self.sent & frame_waits)
        if self._grant is None:
            m.d.comb += taken.eq(due)
            m.d.sync += self.sent.eq(taken)
            return taken
        m.d.comb += taken.eq(due & self._grant)
        with m.If(taken | self._wire.take_hello | self._wire.take_frame):  # other sheets may send before
            m.d.sync += self.sent.eq(taken)
        return taken

    def begin(self, end: Signal) -> list:
        return [end.eq(self._reporter.length)]


class Readings:
    """Readings of units, a packet per sweep, among a link's packets; ``sent`` and ``byte`` as in :class:`Reports`."""

    def __init__(self, m: Module, link: wiring.Component, wire: Wire):
        self._wire = wire
        self.sent = Signal(name="is_units")
        self._frames = Signal(range(FRAMES_BEFORE_UNITS + 1), name="frames")  # since the last readings
        self._due, self.byte = link.units.due, link.units.byte
        self._length = 1 + plain_bytes(link.skin.units, link.derived.units.converter.bits)
        m.d.comb += [link.units.taken.eq(wire.take_units), link.units.place.eq(wire.offset)]

    def choose(self, m: Module, hello_due: Value, frame_waits: Value) -> Value:
        """Whether readings are next, while the wire is idle."""
        taken = self._wire.take_units
        units_next = self._frames == FRAMES_BEFORE_UNITS
        others = hello_due | self._wire.take_report | frame_waits & ~units_next
        m.d.comb += taken.eq(self._due & ~others)
        m.d.sync += self.sent.eq(taken)
        with m.If(self._wire.take_frame & ~units_next):
            m.d.sync += self._frames.eq(self._frames + 1)
        return taken

    def begin(self, end: Signal) -> list:
        return [self._frames.eq(0), end.eq(self._length)]
