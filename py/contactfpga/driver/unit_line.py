"""What a board says of its pressure units: sweeps, those that are missing, and when each was."""

from __future__ import annotations

from contactfpga.driver.stats import Stats
from contactfpga.driver.timeline import Timeline
from contactfpga.wire.hello import Hello
from contactfpga.wire.units import SEQUENCE_BITS, decode_sweep
from contactfpga.zones.units import UnitHistory, UnitSamples


class UnitLine:
    """The sweeps of a board since it was powered up or another Skin loaded."""

    def __init__(self, stats: Stats):
        self.history: UnitHistory | None = None
        """The last readings; None: the board has no units."""
        self._stats = stats
        self._sequence: int | None = None  # of the last sweep

    def forget(self) -> None:
        """The board was restarted, or is another one."""
        self.history = self._sequence = None

    def take_hello(self, hello: Hello) -> None:
        """What the board has."""
        if hello.units is None:
            self.forget()
        elif self.history is None or self.history.facts != hello.units:
            self.history = UnitHistory(hello.units, hello.clock_hz)

    def take(self, plain: bytes, timeline: Timeline) -> UnitSamples | None:
        """An unsealed packet; None where its time is not known. Raises :class:`PacketError`."""
        if self.history is None:
            return None
        sweep = decode_sweep(plain, self.history.facts)
        self._stats.sweeps += 1
        if self._sequence is not None:
            self._stats.sweeps_lost += (sweep.sequence - self._sequence - 1) % (1 << SEQUENCE_BITS)
        self._sequence = sweep.sequence
        time_us = timeline.place(sweep.time_us)
        samples = None if time_us is None else self.history.add(sweep, time_us)
        if samples is None:
            self._stats.sweeps_unexplained += 1
        return samples
