"""Device time in us, and its value at the start of a frame."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import EPOCH_BITS, HEARD_BITS, TIME_BITS
from contactfpga_hdl.util.upset import upset_count

RETRY_BIT = 16
"""Bit of the time whose toggles retry stuck columns."""


class FrameClock(wiring.Component):
    """Counts microseconds, and stores values as a frame begins.

    runs (in): the time advances, at power-up from ``ahead`` clocks after, or before, 0.
    request (in): pulse when a request is received.
    heard (in): lowest bits of the number of the last request.
    frame_begins (in): pulse.
    time (out): device time in us.
    epoch (out): pulse in the first clock of each further 2^``EPOCH_BITS`` us.
    waiting (out): a request was received since the last frame began.
    begun, requested, known (out): ``time``, ``waiting`` and ``heard`` as the last frame began.
    upset (out): a bit of the time flipped by itself (:mod:`contactfpga_hdl.util.upset`); not with ``dual``.
    """

    def __init__(self, skin: Skin, ahead: int = 0):
        self.skin = skin
        self.ahead = ahead
        self._per_us = skin.derived.clocks_per_us
        super().__init__(
            {
                "runs": In(1, init=1),
                "request": In(1),
                "heard": In(HEARD_BITS),
                "frame_begins": In(1),
                "time": Out(TIME_BITS, init=ahead // self._per_us % (1 << TIME_BITS)),
                "epoch": Out(1),
                "waiting": Out(1),
                "begun": Out(TIME_BITS),
                "requested": Out(1),
                "known": Out(HEARD_BITS),
                "upset": Out(1),
            }
        )

    def elaborate(self, platform):
        m = Module()
        time = self.time
        # Time in us
        prescaler = Signal(range(max(2, self._per_us)), init=self.ahead % self._per_us)
        ticks = Signal()
        m.d.comb += ticks.eq(self.runs & (prescaler == self._per_us - 1))
        with m.If(self.runs):
            m.d.sync += [prescaler.eq(Mux(ticks, 0, prescaler + 1)), time.eq(time + ticks)]
        if not self.skin.dual:
            m.d.comb += self.upset.eq(upset_count(m, "time", time, ticks))
        watch_epoch(m, time, self.epoch, late=self.ahead < 0)
        # Values as the frame begins
        with m.If(self.frame_begins):
            m.d.sync += [
                self.begun.eq(time),
                self.requested.eq(self.waiting),
                self.waiting.eq(self.request),
                self.known.eq(self.heard),
            ]
        with m.Elif(self.request):
            m.d.sync += self.waiting.eq(1)
        return m


def watch_epoch(m: Module, time: Signal, epoch: Signal, late: bool = False) -> None:
    """Drive ``epoch``; ``late``: the time begins below 0."""
    highest = time[EPOCH_BITS - 1]
    counts = Signal(init=not late)  # not when 0 is first reached
    before = Signal(name="before_epoch")
    m.d.sync += [counts.eq(counts | ~highest), before.eq(highest & counts)]
    m.d.comb += epoch.eq(before & ~highest)
