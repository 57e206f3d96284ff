"""A message: a board's raw bytes after a header that exposes losses."""

from __future__ import annotations

import dataclasses
import struct

from contactfpga.driver.stats import NetCounters

_HEAD = struct.Struct("<4sQQQqI")
_NAME, VERSION = b"cfp", b"1"
_MAGIC = _NAME + VERSION
HEAD_BYTES = _HEAD.size

MOST_BYTES = 1 << 16
MOST_ASKED = 512
BREAK_S = 2.0
"""Gap after which the number of wraps of frame times is unknown."""
BEAT_S = 0.25
"""Longest interval of a publisher's messages, which shows losses without later data."""
QUIET_S = 2 * BEAT_S
"""Time without an accepted message after which contradicting ones may be genuine."""


@dataclasses.dataclass(frozen=True, slots=True)
class Message:
    publisher: int
    """Random number, drawn at each start of a publisher."""
    sequence: int
    """Messages before this one."""
    offset: int
    """Bytes before this message's."""
    read_us: int
    """Read time, on the publisher's clock."""
    denied: int
    """Messages to the board that the publisher refused."""
    data: bytes

    def encode(self) -> bytes:
        fields = (self.publisher, self.sequence, self.offset, self.read_us, self.denied)
        return _HEAD.pack(_MAGIC, *fields) + self.data

    @classmethod
    def decode(cls, payload: bytes) -> Message | None:
        if not HEAD_BYTES <= len(payload) <= HEAD_BYTES + MOST_BYTES or not payload.startswith(_MAGIC):
            return None
        _, publisher, sequence, offset, read_us, denied = _HEAD.unpack_from(payload)
        return cls(publisher, sequence, offset, read_us, denied, payload[HEAD_BYTES:])

    def follows(self, other: Message) -> bool:
        """Whether the publisher can have sent this after the other, with any messages between."""
        after = self.sequence > other.sequence and self.offset >= other.offset + len(other.data)
        return self.publisher == other.publisher and after

    def continues(self, other: Message) -> bool:
        """Whether this message is the next after the other."""
        return self.follows(other) and (self.sequence, self.offset) == (
            other.sequence + 1,
            other.offset + len(other.data),
        )


def token(publisher: int) -> str:
    """A publisher's number in the key of its liveliness token."""
    return f"{publisher:016x}"


class Stream:
    """Reassembles the bytes of messages, with a delimiter in each gap, so that no packet mixes two.

    Anyone who may write under the key can forge messages. A message that continues the last one is accepted at once.
    Any other is held until the next message follows it; if it contradicts the last one, nothing may have been accepted
    for :data:`QUIET_S`, either. So a forged message blocks later ones for at most :data:`QUIET_S` and two beats.
    """

    def __init__(self, counters: NetCounters):
        self.heard_s: float | None = None
        """Arrival of the last message that its publisher can have sent now."""
        self.ended = False
        """Whether the publisher announced its end, without later messages."""
        self.other_version = False
        """Whether only messages of another version arrived."""
        self._counters = counters
        self._last: Message | None = None
        self._doubted: Message | None = None
        self._taken_s = 0.0  # when the last one came

    @property
    def publisher(self) -> int | None:
        """Number of the publisher in use; None before its first message."""
        return None if self._last is None else self._last.publisher

    def take(self, payload: bytes, now_s: float) -> list[tuple[bytes, bool]]:
        """Bytes added by a message that arrives at ``now_s``: pieces, each with whether it follows a break."""
        message = Message.decode(payload)
        if message is None:
            self._counters.refused += 1
            self.other_version |= self.heard_s is None and payload.startswith(_NAME) and not payload.startswith(_MAGIC)
            return []
        pieces = []
        may_come, doubted = self._may_come(message, now_s), self._doubted
        if doubted is not None and self._may_come(doubted, now_s) and not may_come:
            self._counters.refused += 1
            return []
        self._doubted = message
        if self._last is not None and message.continues(self._last):
            pieces.append(self._add(message, now_s))
            self._doubted = None
            if doubted is not None and doubted.continues(message):  # they came in the wrong order
                pieces.append(self._add(doubted, now_s))
                doubted = None
        elif doubted is not None and message.follows(doubted) and self._may_come(doubted, now_s):
            pieces.append(self._add(doubted, now_s))
            if message.continues(doubted):
                pieces.append(self._add(message, now_s))
                self._doubted = None
            doubted = None
        self._counters.refused += doubted is not None
        if pieces or may_come:
            self.heard_s, self.other_version = now_s, False
        return pieces

    def _may_come(self, message: Message, now_s: float) -> bool:
        last = self._last
        if last is None or message.follows(last) or now_s - self._taken_s >= QUIET_S:
            return True
        return self.ended and message.publisher != last.publisher

    def _add(self, message: Message, now_s: float) -> tuple[bytes, bool]:
        counters, last = self._counters, self._last
        counters.messages += 1
        counters.denied = message.denied
        self._last, self._taken_s, self.ended = message, now_s, False
        if last is None or message.publisher != last.publisher:
            counters.publishers += 1
            hole = broken = last is not None
        elif not message.follows(last):
            hole = broken = True
        else:
            missing = message.offset - last.offset - len(last.data)
            counters.lost_messages += message.sequence - last.sequence - 1
            counters.lost_bytes += missing
            broken = not 0 <= message.read_us - last.read_us <= BREAK_S * 1e6
            hole = missing > 0 or broken
        counters.breaks += broken
        return (b"\0" if hole else b"") + message.data, broken
