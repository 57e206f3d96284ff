"""A message: a board's raw bytes, and before them a head that shows what is missing."""

from __future__ import annotations

import dataclasses
import struct

from contactfpga.driver.stats import NetCounters

_HEAD = struct.Struct("<4sQQQqI")
_NAME, VERSION = b"cfp", b"1"
_MAGIC = _NAME + VERSION
HEAD_BYTES = _HEAD.size

MOST_BYTES = 1 << 16
"""Of a board in one message."""
MOST_ASKED = 512
"""Bytes of one message to a board."""
BREAK_S = 2.0
"""After a hole of this length nobody knows any more how often the frames' times wrapped in it."""
BEAT_S = 0.25
"""A publisher sends a message at least this often, so that a loss shows also where nothing follows it."""
QUIET_S = 2 * BEAT_S
"""After this long without a message that was taken, messages that contradict the last one may be the genuine ones."""


@dataclasses.dataclass(frozen=True, slots=True)
class Message:
    """What a publisher sends."""

    publisher: int
    """A random number that each start of a publisher draws."""
    sequence: int
    """Messages before this one."""
    offset: int
    """Bytes before this message's."""
    read_us: int
    """When they were read, on the publisher's clock."""
    denied: int
    """Messages to the board that it did not pass on."""
    data: bytes

    def encode(self) -> bytes:
        """The payload."""
        fields = (self.publisher, self.sequence, self.offset, self.read_us, self.denied)
        return _HEAD.pack(_MAGIC, *fields) + self.data

    @classmethod
    def decode(cls, payload: bytes) -> Message | None:
        """None for what no publisher sends."""
        if not HEAD_BYTES <= len(payload) <= HEAD_BYTES + MOST_BYTES or not payload.startswith(_MAGIC):
            return None
        _, publisher, sequence, offset, read_us, denied = _HEAD.unpack_from(payload)
        return cls(publisher, sequence, offset, read_us, denied, payload[HEAD_BYTES:])

    def follows(self, other: Message) -> bool:
        """Whether its publisher can have sent it after the other, with any number of messages between them."""
        after = self.sequence > other.sequence and self.offset >= other.offset + len(other.data)
        return self.publisher == other.publisher and after

    def continues(self, other: Message) -> bool:
        """Whether it is the very next one."""
        return self.follows(other) and (self.sequence, self.offset) == (
            other.sequence + 1,
            other.offset + len(other.data),
        )


def token(publisher: int) -> str:
    """How a publisher's number reads in the key of its token of liveliness."""
    return f"{publisher:016x}"


class Stream:
    """Puts the bytes of messages together again, with a delimiter in each hole, so that no packet is made of two.

    Whoever may write under the key can forge messages. A message that continues the last one is taken at once. Any
    other, such as the first and one after a hole, is doubted until the next message follows it. If it contradicts the
    last one, nothing may have been taken for :data:`QUIET_S`, either. So a single forged message keeps out what comes
    after it for at most :data:`QUIET_S` and two beats.
    """

    def __init__(self, counters: NetCounters):
        self.heard_s: float | None = None
        """When a message came that its publisher can have sent now."""
        self.ended = False
        """The publisher has said that it ends, and no message of it came since: another may follow at once."""
        self.other_version = False
        """Messages of another version came, and none of this one."""
        self._counters = counters
        self._last: Message | None = None
        self._doubted: Message | None = None
        self._taken_s = 0.0  # when the last one came

    @property
    def publisher(self) -> int | None:
        """Number of the publisher that is read; None before its first message."""
        return None if self._last is None else self._last.publisher

    def take(self, payload: bytes, now_s: float) -> list[tuple[bytes, bool]]:
        """What a message that comes at ``now_s`` adds: pieces of bytes, each with whether it comes after a break."""
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
        """Whether a message may come after the last one, though it does not continue it."""
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
