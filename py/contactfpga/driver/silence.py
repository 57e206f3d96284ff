"""When a board is silent: no frame for longer than it may take to send one."""

from __future__ import annotations

import dataclasses

from contactfpga.inputs.values import is_finite, shown
from contactfpga.skin import Skin, limits
from contactfpga.skin.derived import Derived
from contactfpga.skin.widths import Widths
from contactfpga.wire.hello import Hello
from contactfpga.zones.zone import Zones

BETWEEN_BYTES = 160
"""What may go out between two frames: a hello and a report of faults."""


@dataclasses.dataclass(frozen=True)
class Silence:
    """No frame came for longer than allowed. This says nothing about the sheet, which may be touched."""

    port: str
    seconds: float
    """How long no frame came."""
    bytes: int
    """Bytes that came in this time without making a frame."""
    last: Zones | None
    """The frame that came last; None if none has come yet."""

    def __str__(self) -> str:
        if self.last is None:
            last = "none has come yet"
        else:
            last = f"the last was frame {self.last.sequence} at {self.last.time_us / 1e6:.3f} s"
        came = f"{self.bytes} other bytes came" if self.bytes else "not one byte came"
        return f"{self.port}: no data for {self.seconds:.3g} s, {last}; {came} since"


def longest_pause_s(hello: Hello | Skin, skin: Skin | None) -> float:
    """The longest time from a frame's last byte to the next one's, of a board that works: a keep-alive or a scan, and
    a frame on the wire. Of a board whose Skin is not known its scan counts nothing, and its keep-alive the most."""
    wire_s = (Widths(hello.sheet).max_frame_bytes + BETWEEN_BYTES) * 10 / hello.baud
    if hello.send == "on_change":
        return (limits.MAX_KEEP_ALIVE_MS if skin is None else skin.keep_alive_ms) / 1000 + wire_s
    return wire_s + (0.0 if skin is None else Derived(skin).max_frame_clocks / hello.clock_hz)


def checked_deadline(name: str, deadline_s: float, hello: Hello, skin: Skin | None) -> float:
    """A deadline in seconds; raises ValueError unless a board that works can meet it."""
    if not is_finite(deadline_s) or deadline_s <= 0:
        raise ValueError(f"{name} is {shown(deadline_s)}; it must be a positive number of seconds")
    least = longest_pause_s(hello, skin)
    if deadline_s < least:
        why = "with send = 'on_change' it sends a frame only when something changes, or to keep alive"
        pause = why if hello.send == "on_change" else "a scan and a frame on the wire take that long"
        raise ValueError(f"{name} is {deadline_s:g}; this board may be silent for {least:.3g} s, as {pause}")
    return float(deadline_s)
