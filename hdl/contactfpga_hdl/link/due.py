"""Unrequested packets: a hello every half second with a scan that waits, and a frame after a long pause."""

from amaranth.hdl import Module, Mux, Signal, Value
from amaranth.lib import wiring

from contactfpga.skin.derived import HELLO_BIT, KEEP_ALIVE_BIT


def hello_period(m: Module, link: wiring.Component) -> Value:
    """Pulse every half second."""
    return _toggles(m, link, HELLO_BIT)


def keep_alive(m: Module, link: wiring.Component) -> None:
    """Set ``link.due``: a frame is to be sent although nothing has changed."""
    decide, sends = link.frames.decide, link.frames.verdict.send
    if link.derived.scan.waits:
        most = link.derived.keep_alive_toggles
        toggles = Signal(range(most + 1), init=most)  # of the clock's bit, since the last frame sent
        m.d.comb += link.due.eq(toggles == most)
        with m.If(_toggles(m, link, KEEP_ALIVE_BIT) & ~link.due):
            m.d.sync += toggles.eq(toggles + 1)
        with m.If(decide & sends):
            m.d.sync += toggles.eq(0)
        return
    limit = link.derived.keep_alive_frames
    pause = Signal(range(limit), init=limit - 1)  # since the last frame sent
    m.d.comb += link.due.eq(pause == limit - 1)
    with m.If(decide):
        m.d.sync += pause.eq(Mux(sends, 0, pause + 1))


def _toggles(m: Module, link: wiring.Component, bit: int) -> Value:
    before = Signal(name=f"time_{bit}")
    m.d.sync += before.eq(link.time[bit])
    return link.time[bit] ^ before
