"""Bytes in, zones out: finds packets, decodes frames, keeps count of all that goes wrong."""

from __future__ import annotations

import dataclasses
import math
from collections import Counter

from contactfpga import protocol
from contactfpga.derived import SEQUENCE_BITS, TIME_BITS, Derived
from contactfpga.errors import SkinMismatch, VersionMismatch
from contactfpga.limits import MAX_LINES
from contactfpga.protocol import Frame, Hello, PacketError
from contactfpga.skin import Skin, SkinError
from contactfpga.zone import Zones

WRAP_US = 1 << TIME_BITS
_SEQUENCES = 1 << SEQUENCE_BITS
Item = Zones | Hello | SkinMismatch | VersionMismatch
_RESTART_US = 1_000_000
"""A board whose first frame this is started less than this long ago."""


@dataclasses.dataclass
class Stats:
    """What came over one port since it was opened."""

    frames: int = 0
    """Frames received whole."""
    lost: int = 0
    """Frames the board sent that did not arrive whole, from the gaps in their sequence numbers, a gap modulo 256."""
    gaps: int = 0
    """Pauses between frames in which 256 may have been sent, so that ``lost`` may miss a multiple of 256; only with
    ``send = "always"``, as else a pause is nothing unusual."""
    overwritten: int = 0
    """Frames the board replaced by newer ones before it sent them, a gap modulo 2^``Derived.overwritten_bits``."""
    damaged: Counter[str] = dataclasses.field(default_factory=Counter)
    """Packets refused, by reason: framing, crc, length, kind, content, noise."""
    resynchronised: int = 0
    """Valid packets that followed damaged ones."""
    hellos: int = 0
    """Hellos received."""
    before_hello: int = 0
    """Frames that came before the first hello, without which they cannot be read."""
    foreign_version: int = 0
    """Packets of another protocol version."""
    foreign_skin: int = 0
    """Frames of a board built from another Skin than the one asked for."""
    skin_changes: int = 0
    """Hellos that told of another Skin than the one before."""
    restarts: int = 0
    """Times the board began to count its frames anew."""
    discarded_bytes: int = 0
    """Bytes thrown away unread because newer ones were wanted; the frames in them do not count as lost."""
    bytes: int = 0
    """All bytes received."""


class Receiver:
    """Decodes one port's bytes."""

    def __init__(self, port: str, expected: Skin | None = None, live: bool = True):
        self.port = port
        self.stats = Stats()
        self.skin: Skin | None = None
        """Skin of the board; None until a hello has come, or when it is not the expected one."""
        self.hello: Hello | None = None
        """The last hello."""
        self._expected = expected
        self._live = live
        self._derived: Derived | None = None
        self._longest = Derived(
            Skin(rows=MAX_LINES, columns=MAX_LINES, connectivity=4, settle_us=100.0)
        ).max_frame_bytes
        self._hello_packet = b""
        self._rest = b""
        self._begun = False  # the first piece is cut off by when we began to listen; it is no damage
        self._damage = False
        self._last: Frame | None = None
        self._time_us = 0
        self._now = 0.0
        self._counting = False
        self._shortest_us: float = math.inf  # from a frame to the one sent next

    def feed(self, data: bytes, now: float) -> list[Item]:
        """What ``data`` completes, in order: zones, hellos, and the errors that hellos give cause for.

        ``now`` is the time of its arrival in seconds.
        """
        self.stats.bytes += len(data)
        *packets, self._rest = (self._rest + data).split(b"\0")
        items = []
        for packet in packets:
            if packet and (item := self._packet(packet, now)) is not None:
                items.append(item)
        if len(self._rest) > self._longest:
            self._refuse("noise")
            self._rest = b""
        return items

    def discard(self, data: bytes) -> None:
        """Count ``data`` and forget it, but for the packet that has begun."""
        self.stats.bytes += len(data)
        self.stats.discarded_bytes += len(data)
        if b"\0" in data:
            self._rest = b""
        self._rest = (self._rest + data[data.rfind(b"\0") + 1 :])[-self._longest :]
        self._counting = False

    def _packet(self, packet: bytes, now: float) -> Item | None:
        item: Item | None = None
        if packet == self._hello_packet:
            self.stats.hellos += 1
            item = self.hello
        else:
            try:
                item = self._decode(packet, now)
            except PacketError as error:
                if error.reason == "version":
                    return self._foreign(error)
                self._refuse(error.reason)
                return None
        self._begun = True
        if self._damage:
            self._damage = False
            self.stats.resynchronised += 1
        return item

    def _refuse(self, reason: str) -> None:
        if self._begun:
            self.stats.damaged[reason] += 1
            self._damage = True
        self._begun = True

    def _decode(self, packet: bytes, now: float) -> Item | None:
        plain = protocol.unseal(packet)
        if protocol.kind_of(plain) == protocol.KIND_HELLO:
            return self._take_hello(protocol.decode_hello(plain), packet)
        if self._derived is None or self.skin is None:
            if self.hello is None:
                self.stats.before_hello += 1
            else:
                self.stats.foreign_skin += 1
            return None
        frame = protocol.decode_frame(plain, self._derived)
        before, before_us, counting = self._last, self._time_us, self._counting
        self._count(frame, self._derived)
        self._time_us = self._unwrap(frame.time_us, now)
        if before is not None and self._last is not None and counting:
            self._count_gap((frame.sequence - before.sequence) % _SEQUENCES, self._time_us - before_us)
        self._last, self._now, self._counting = frame, now, True
        return Zones(frame, self.skin, self._time_us, before)

    def _foreign(self, error: PacketError) -> VersionMismatch | None:
        self.stats.foreign_version += 1
        if error.kind != protocol.KIND_HELLO:
            return None
        return VersionMismatch(
            f"{self.port} speaks protocol version {error.version}, this host version {protocol.VERSION}; "
            "load a bitstream and install a contactfpga of the same release"
        )

    def _take_hello(self, hello: Hello, packet: bytes) -> Hello | SkinMismatch:
        try:
            told = hello.skin()
        except SkinError as error:
            raise PacketError("content", f"hello of a Skin that cannot be: {error}") from None
        self.stats.hellos += 1
        before, self.hello, self._hello_packet = self.hello, hello, packet
        expected = self._expected
        changed = before is not None and before != hello
        if changed:
            self.stats.skin_changes += 1
            self._last, self._counting, self._shortest_us = None, False, math.inf
        if expected is not None and hello.fingerprint != expected.fingerprint:
            self.skin = self._derived = None
            return SkinMismatch(
                f"{self.port} was built from {_describe(hello)}; asked for was {_describe(Hello.of(expected))}; "
                "give its own Skin or none, or load the bitstream of this one"
            )
        self.skin = expected or told
        self._derived = Derived(self.skin)
        if not changed or before is None:
            return hello
        return SkinMismatch(
            f"{self.port} now has {_describe(hello)}, before it was {_describe(before)}: another bitstream was "
            "loaded; frames from here on are of the new Skin"
        )

    def _count(self, frame: Frame, derived: Derived) -> None:
        self.stats.frames += 1
        last = self._last
        if last is None or not self._counting:
            return
        if frame.sequence == 0 and last.sequence != _SEQUENCES - 1 and frame.time_us < _RESTART_US:
            self.stats.restarts += 1
            self._last = None
            return
        self.stats.lost += (frame.sequence - last.sequence - 1) % _SEQUENCES
        self.stats.overwritten += (frame.overwritten - last.overwritten) % (1 << derived.overwritten_bits)

    def _count_gap(self, steps: int, us: int) -> None:
        if steps == 1 and us > 0:
            self._shortest_us = min(self._shortest_us, us)
        assert self.hello is not None
        if self.hello.send == "always" and us >= _SEQUENCES * self._shortest_us:
            self.stats.gaps += 1

    def _unwrap(self, raw: int, now: float) -> int:
        if self._last is None:
            return raw
        if not self._live:
            return self._time_us + (raw - self._time_us) % WRAP_US
        # Bytes wait a few seconds at most before they are read, so the nearest of the possible times is the right one.
        likely = self._time_us + (now - self._now) * 1e6
        return raw + WRAP_US * round((likely - raw) / WRAP_US)


def report_of(told: Hello | Skin) -> str:
    """What a board reports, in words."""
    precise = f" of {told.barycenter_bits} fraction bits" if told.report == "barycenter" else ""
    return f"report {told.report!r}{precise}"


def _describe(hello: Hello) -> str:
    return (
        f"a {hello.rows}x{hello.columns} Skin (fingerprint {hello.fingerprint.hex()}, {report_of(hello)}, "
        f"connectivity {hello.connectivity})"
    )
