"""Memory that a process writes and others read without a lock: a slot for what is newest, and a ring of messages.

One process writes. Readers never stop it: they copy, and then look whether it wrote meanwhile. That needs a processor
which keeps the order of stores (x86); on others each copy is checked by a sum as well.
"""

from __future__ import annotations

import platform
import struct
import time
import zlib
from typing import NamedTuple

WORD = 8
ORDERED = platform.machine().lower() in ("x86_64", "amd64", "i686", "i386")
"""Whether the processor keeps the order of stores."""

PATIENCE_S = 2.0
"""A slot that is being written for so long has lost its writer."""


class WriterGone(Exception):
    """Who writes the memory ended in the middle of it."""


def check_of(data: bytes | memoryview) -> int:
    """A sum that tells a torn copy where the order of stores does not."""
    return 0 if ORDERED else zlib.crc32(data)


class Slot:
    """Bytes with a sequence lock: :meth:`read` gives the whole of what one :meth:`write` put there.

    The first word counts: odd while the slot is written. The second one holds the length and the check sum.
    """

    HEAD = 2 * WORD

    def __init__(self, memory: memoryview):
        self._bytes = memory
        self._words = memory.cast("Q")

    @property
    def room(self) -> int:
        """Bytes that it can hold."""
        return len(self._bytes) - self.HEAD

    @property
    def version(self) -> int:
        """Changes with each :meth:`write`."""
        return self._words[0]

    def write(self, data: bytes) -> None:
        """For the one writer. Raises ValueError where there is no room."""
        if len(data) > self.room:
            raise ValueError(f"{len(data)} bytes are too many for a slot of {self.room}")
        words = self._words
        before = words[0]
        words[0] = before + 1
        words[1] = len(data) | check_of(data) << 32
        self._bytes[self.HEAD : self.HEAD + len(data)] = data
        words[0] = before + 2

    def read(self) -> bytes:
        """What was written last. Raises :class:`WriterGone`."""
        words, tries, until = self._words, 0, 0.0
        while True:
            before = words[0]
            if not before & 1:
                told = words[1]
                data = bytes(self._bytes[self.HEAD : self.HEAD + (told & 0xFFFFFFFF)])
                if self._same(before) and check_of(data) == told >> 32:
                    return data
            tries += 1
            if tries > 20:  # the writer was interrupted
                until = until or time.monotonic() + PATIENCE_S
                if time.monotonic() > until:
                    raise WriterGone
                time.sleep(20e-6)

    def _same(self, before: int) -> bool:
        """Whether nothing was written since."""
        return self._words[0] == before


class Message(NamedTuple):
    """What the ring says of a message besides its bytes."""

    kind: int
    frames_before: int
    """Frames in all messages before this one."""
    errors_before: int
    sides_before: int
    frames: int
    """Frames in this one."""
    answers: int
    """Tickets that are answered with it; see :attr:`contactfpga.driver.conversation.Arrival.answers`."""
    end: int
    """Where the next message begins."""


class Marks(NamedTuple):
    """How far the writer has come; all of one moment."""

    head: int
    """Where the next message will begin."""
    frames: int
    """In all messages."""
    errors: int
    sides: int
    answered: int
    last: int
    """Where the newest message with a frame begins; -1: there is none."""
    facts: int
    """Version of the facts that belong to this moment."""
    bytes: int
    """That had come."""
    last_bytes: int
    """Those of them that had come with the newest frame."""
    last_s: float
    """When it came."""


_MARKS = struct.Struct("9qd")
_PAD, _COUNTS = struct.Struct("2Q"), struct.Struct("5Q")
_HEADER_WORDS = 8
_ALIGNED = 16
PAD, FRAME, RUN, ERROR, SIDE, SWEEP = range(6)
"""Kinds of messages. The first one fills the end of the ring; the last one is for the history of pressure units."""


class Ring:
    """Messages in the order in which they came; the oldest are overwritten. A place is the number of bytes before it
    since the ring began, and never comes again."""

    HEAD = 256
    """Bytes before the messages: the oldest place, and the marks."""

    def __init__(self, memory: memoryview):
        self._bytes = memory[self.HEAD :]
        self._words = self._bytes.cast("Q")
        self._size = len(self._bytes)
        self._tail = memory[:WORD].cast("Q")
        self._slot = Slot(memory[2 * WORD : self.HEAD])
        self._known: tuple[int, Marks | None] = -1, None

    # ---- for the writer

    def begin(self) -> None:
        """Make it empty."""
        self._tail[0] = 0
        self._head = self._shown = self._frames = self._errors = self._sides = self._answered = 0
        self._last = -1
        self._starts: list[tuple[int, int]] = []
        self.publish(0, 0, 0, 0.0)

    def put(self, kind: int, body: bytes, frames: int = 0, answers: int = 0) -> None:
        """Append a message, which :meth:`publish` shows."""
        length = -(-(_HEADER_WORDS * WORD + len(body)) // _ALIGNED) * _ALIGNED
        if length > self._size // 4:
            raise ValueError(f"a message of {length} bytes is too long for a ring of {self._size}")
        left = self._size - self._head % self._size
        if length > left:
            self._make_room(left)
            place = self._head % self._size // WORD
            self._words[place], self._words[place + 1] = left, PAD
            self._head += left
        self._make_room(length)
        place = self._head % self._size
        word = place // WORD
        words = self._words
        words[word] = length
        words[word + 1] = kind
        words[word + 2] = self._frames
        words[word + 3] = self._errors
        words[word + 4] = self._sides
        words[word + 5] = frames
        words[word + 6] = answers
        words[word + 7] = len(body) | check_of(body) << 32
        start = place + _HEADER_WORDS * WORD
        self._bytes[start : start + len(body)] = body
        if frames:
            self._last = self._head
            self._frames += frames
            self._answered = max(self._answered, answers)
        elif kind == ERROR:
            self._errors += 1
        elif kind == SIDE:
            self._sides += 1
        self._head += length

    @property
    def hidden(self) -> int:
        """Bytes of messages that are not shown yet."""
        return self._head - self._shown

    @property
    def size(self) -> int:
        """Bytes of messages that it holds at most."""
        return self._size

    def _make_room(self, length: int) -> None:
        tail = self._tail[0]
        while self._head + length - tail > self._size:
            tail += self._words[tail % self._size // WORD]
        self._tail[0] = tail

    def publish(self, facts: int, came: int, last_bytes: int, last_s: float) -> None:
        """Show all messages; ``came``: bytes from the board by now, ``last_bytes``: those by the newest frame."""
        counts = self._head, self._frames, self._errors, self._sides, self._answered, self._last
        self._slot.write(_MARKS.pack(*counts, facts, came, last_bytes, last_s))
        self._shown = self._head

    # ---- for readers

    def marks(self) -> Marks:
        """How far the writer has come. Raises :class:`WriterGone`."""
        version, marks = self._known
        if version != self._slot.version or marks is None:
            version = self._slot.version
            marks = Marks._make(_MARKS.unpack(self._slot.read()))
            self._known = version, marks  # of this version, or of a later one
        return marks

    @property
    def shown(self) -> int:
        """Changes whenever :meth:`marks` do."""
        return self._slot.version

    @property
    def tail(self) -> int:
        """Where the oldest message begins that is not overwritten."""
        return self._tail[0]

    def look(self, place: int) -> Message | None:
        """What begins at a place before the head; None where it is overwritten."""
        start = place % self._size
        length, kind = _PAD.unpack_from(self._bytes, start)
        if kind == PAD:
            return Message(PAD, 0, 0, 0, 0, 0, place + length) if self._kept(place) else None
        frames, errors, sides, count, answers = _COUNTS.unpack_from(self._bytes, start + _PAD.size)
        if not self._kept(place):
            return None
        return Message(kind, frames, errors, sides, count, answers, place + length)

    def body(self, place: int) -> bytes | None:
        """The bytes of this message; None where it is overwritten."""
        start = place % self._size
        told = self._words[start // WORD + _HEADER_WORDS - 1]
        start += _HEADER_WORDS * WORD
        data = bytes(self._bytes[start : start + (told & 0xFFFFFFFF)])
        return data if self._kept(place) and check_of(data) == told >> 32 else None

    def _kept(self, place: int) -> bool:
        """Whether what was copied from there was not overwritten meanwhile."""
        return self._tail[0] <= place
