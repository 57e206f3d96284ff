"""Events besides frames: faults of the lines, sweeps of the pressure units, and silence."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable

from contactfpga.driver.clock import Timeline
from contactfpga.driver.stats import Stats
from contactfpga.inputs.values import is_finite, shown
from contactfpga.skin import Skin
from contactfpga.skin.derived import Widths
from contactfpga.wire.faults import STUCK, UNNAMED, Faults, SelfTestSlot, decode_faults
from contactfpga.wire.hello import Hello
from contactfpga.wire.units import SEQUENCE_BITS, decode_sweep
from contactfpga.zones.units import UnitHistory, UnitSamples
from contactfpga.zones.zone import Zones

SideEvent = Faults | SelfTestSlot | UnitSamples


class Lines:
    """The last fault report of a board, and the names of its faults while frames are flagged.

    A report that faults are gone overtakes the last flagged frames, so the names hold until an unflagged frame or
    another report.
    """

    def __init__(self, mask: Iterable[tuple[int, int]] = ()):
        self.reported: Faults | None = None
        """The last report; None: none since power-up or a change of the Skin."""
        self.fading = False
        """Whether the next unflagged frame clears the names."""
        self._mask = tuple(mask)
        self._unnamed: tuple[str, ...] = (STUCK,)
        self._names: tuple[str, ...] = self._unnamed

    def forget(self) -> None:
        self.reported, self.fading, self._names = None, False, self._unnamed

    def take_hello(self, hello: Hello) -> None:
        unnamed = UNNAMED if hello.guard or (hello.self_test and self.reported is None) else STUCK
        if self._names == self._unnamed:
            self._names = (unnamed,)
        self._unnamed = (unnamed,)

    def take_report(self, plain: bytes, hello: Hello) -> Faults | None:
        """Decode an unsealed report; returns it if it is new. Raises :class:`PacketError`."""
        sheet = hello.sheet
        found = decode_faults(plain, sheet.rows, sheet.columns, hello.guard, hello.self_test)
        found = found.named(sheet.rows, sheet.columns, self._mask)
        before, self.reported = self.reported or Faults(), found
        self._unnamed = (UNNAMED if hello.guard else STUCK,)
        self.fading = not found and bool(before)
        if not self.fading:
            self._names = found.names or self._unnamed
        return None if found == before else found

    def names(self, flagged: bool) -> tuple[str, ...]:
        if flagged:
            return self._names
        if self.fading:
            self.fading, self._names = False, self._unnamed
        return ()


class UnitLine:
    """The sweeps of a board since power-up or a change of the Skin."""

    def __init__(self, stats: Stats):
        self.history: UnitHistory | None = None
        """The last readings; None: the board has no units."""
        self._stats = stats
        self._sequence: int | None = None  # of the last sweep

    def forget(self) -> None:
        self.history = self._sequence = None

    def take_hello(self, hello: Hello) -> None:
        if hello.units is None:
            self.forget()
        elif self.history is None or self.history.facts != hello.units:
            self.history = UnitHistory(hello.units, hello.clock_hz)

    def take(self, plain: bytes, timeline: Timeline) -> UnitSamples | None:
        """Decode an unsealed sweep; None if its time is unknown. Raises :class:`PacketError`."""
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


BETWEEN_BYTES = 160
"""Most bytes between two frames: a hello and a fault report."""


@dataclasses.dataclass(frozen=True)
class Silence:
    """No frame arrived for longer than allowed. The sheet may be touched all the same.

    >>> with contactfpga.open("sim://") as board:
    ...     board.silence.seconds < 1
    True
    """

    port: str
    seconds: float
    """Duration without a frame."""
    bytes: int
    """Bytes received in this time, none of which completed a frame."""
    last: Zones | None
    """The last frame; None: none yet."""

    def __str__(self) -> str:
        if self.last is None:
            last = "none has come yet"
        else:
            last = f"the last was frame {self.last.sequence} at {self.last.time_us / 1e6:.3f} s"
        came = f"{self.bytes} other bytes came" if self.bytes else "not one byte came"
        return f"{self.port}: no data for {self.seconds:.3g} s, {last}; {came} since"


def longest_pause_s(hello: Hello | Skin, skin: Skin | None) -> float:
    """The longest time in s between the last bytes of successive frames of a working board: a keep-alive or a scan, and
    a frame. For an unknown Skin, no scan and the longest keep-alive are assumed.
    """
    wire_s = (Widths(hello.sheet).max_frame_bytes + BETWEEN_BYTES) * 10 / hello.baud
    if hello.send == "on_change":
        return (Skin.limits("keep_alive_ms")[1] if skin is None else skin.keep_alive_ms) / 1000 + wire_s
    return wire_s + (0.0 if skin is None else skin.derived.max_frame_clocks / hello.clock_hz)


def checked_deadline(name: str, deadline_s: float, hello: Hello, skin: Skin | None) -> float:
    """A deadline in seconds; raises ValueError unless a working board can meet it."""
    if not is_finite(deadline_s) or deadline_s <= 0:
        raise ValueError(f"{name} is {shown(deadline_s)}; it must be a positive number of seconds")
    least = longest_pause_s(hello, skin)
    if deadline_s < least:
        why = "with send = 'on_change' it sends a frame only when something changes, or to keep alive"
        pause = why if hello.send == "on_change" else "a scan and a frame on the wire take that long"
        raise ValueError(f"{name} is {deadline_s:g}; this board may be silent for {least:.3g} s, as {pause}")
    return float(deadline_s)
