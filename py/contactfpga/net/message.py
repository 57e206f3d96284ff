"""A message: a board's raw bytes, and before them a head that shows what is missing."""

from __future__ import annotations

import dataclasses
import struct

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


@dataclasses.dataclass
class Counters:
    """What happened between a publisher and a ``zenoh://`` port."""

    messages: int = 0
    """Messages received."""
    lost_messages: int = 0
    """Messages that did not come: dropped by choice where the network was too slow, or while it was broken."""
    lost_bytes: int = 0
    """Bytes of the board in them."""
    refused: int = 0
    """Messages that are none of a publisher, came twice or too late, or are of a second publisher of the key."""
    publishers: int = 0
    """Publishers that were heard: 1, and one more for each restart."""
    breaks: int = 0
    """Holes after which times are not known before the next hello."""
    passed_breaks: int = 0
    """Those of them that were read, or left out, up to now."""
    left_out: int = 0
    """Bytes that this program did not take in time."""
    denied: int = 0
    """Messages to the board, of all programs, that the publisher did not pass on."""


class Stream:
    """Puts the bytes of messages together again, with a delimiter in each hole, so that no packet is made of two."""

    def __init__(self, counters: Counters):
        self.alive: set[int] = set()
        """Publishers that are known to run: as long as one does, no other follows it."""
        self.other_version = False
        """Messages of another version came, and none of this one."""
        self._counters = counters
        self._last: Message | None = None

    def take(self, payload: bytes) -> tuple[bytes, bool]:
        """The bytes that a message adds, and whether they come after a break."""
        message, counters, last = Message.decode(payload), self._counters, self._last
        if message is None or (last is not None and not self._follows(message, last)):
            counters.refused += 1
            self.other_version |= last is None and payload.startswith(_NAME) and not payload.startswith(_MAGIC)
            return b"", False
        self.other_version = False
        counters.messages += 1
        counters.denied = message.denied
        self._last = message
        if last is None or message.publisher != last.publisher:
            counters.publishers += 1
            counters.breaks += last is not None
            return (b"\0" if last is not None else b"") + message.data, last is not None
        missing = message.sequence - last.sequence - 1
        hole = message.offset - last.offset - len(last.data)
        counters.lost_messages += missing
        counters.lost_bytes += hole
        broken = not 0 <= message.read_us - last.read_us <= BREAK_S * 1e6
        counters.breaks += broken
        return (b"\0" if hole or broken else b"") + message.data, broken

    def _follows(self, message: Message, last: Message) -> bool:
        """Whether a message may come after that one."""
        if message.publisher != last.publisher:
            return last.publisher not in self.alive
        return message.sequence > last.sequence and message.offset >= last.offset + len(last.data)
