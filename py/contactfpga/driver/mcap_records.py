"""The records of an MCAP file, each read within bounds: what a file says of its sizes may be a lie."""

from __future__ import annotations

import io
import zlib
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, BinaryIO

from contactfpga.errors import ContactFPGAError

if TYPE_CHECKING:
    from mcap.records import Chunk

MAGIC = b"\x89MCAP0\r\n"
HEAD = 9
"""Bytes before a record: what it is, and how long."""
LARGEST = 1 << 25
"""Bytes of a record as it is in the file."""
UNPACKED = 1 << 23
"""Bytes of a chunk, unpacked: ours have 64 KiB or one message, other programs' 4 MiB."""
RATIO = 1000
"""How many times as large as it is packed a chunk of more than :data:`FREE` bytes may be: the time for a file goes with
its size. Ours shrink to a third."""
FREE = 1 << 17
_MESSAGE = 22
"""Bytes of a message's record before its data."""


class RecordingError(ContactFPGAError):
    """A file that is no recording, or one that was not closed."""


class Unreadable(Exception):
    """A record that is damaged, or larger than it may be."""


class Cut(Unreadable):
    """The file ends, or cannot be followed, within a record; ``size``: bytes of it that are there."""

    def __init__(self, size: int):
        self.size = size


def record(file: BinaryIO) -> tuple[int, bytes] | None:
    """Kind and content of the record that begins here; None at the end of the file. Raises :class:`Cut`."""
    head = file.read(HEAD)
    if not head:
        return None
    size = int.from_bytes(head[1:], "little")
    data = file.read(size) if len(head) == HEAD and size <= LARGEST else b""
    if len(data) < size or len(head) < HEAD:
        raise Cut(len(head) + len(data))
    return head[0], data


def parsed(kind: Any, data: bytes) -> Any:
    """The record of this class of the library's. Raises :class:`Unreadable`."""
    from mcap.data_stream import ReadDataStream

    try:
        return kind.read(ReadDataStream(io.BytesIO(data)))
    except Exception:  # whatever the library stumbles over
        raise Unreadable from None


def inside(chunk: Chunk) -> Iterator[Any]:
    """Messages, channels and schemas of a chunk, in order. Raises :class:`Unreadable` before the first one where the
    chunk is damaged or unpacks to more than it may."""
    from mcap.opcode import Opcode
    from mcap.records import Channel, Schema

    data = memoryview(_unpacked(chunk))
    at = 0
    while at < len(data):
        kind, size = data[at], int.from_bytes(data[at + 1 : at + HEAD], "little")
        content = data[at + HEAD : at + HEAD + size]
        if len(content) < size or len(data) < at + HEAD:
            raise Unreadable
        if kind == Opcode.MESSAGE:
            yield message(bytes(content))
        elif kind in (Opcode.CHANNEL, Opcode.SCHEMA):
            yield parsed(Channel if kind == Opcode.CHANNEL else Schema, bytes(content))
        at += HEAD + size


def message(data: bytes) -> Any:
    """A message's record. Raises :class:`Unreadable`."""
    from mcap.records import Message

    if len(data) < _MESSAGE:
        raise Unreadable
    channel, sequence = int.from_bytes(data[:2], "little"), int.from_bytes(data[2:6], "little")
    logged, published = int.from_bytes(data[6:14], "little"), int.from_bytes(data[14:_MESSAGE], "little")
    return Message(channel, logged, data[_MESSAGE:], published, sequence)


def _unpacked(chunk: Chunk) -> bytes:
    """Its bytes: as many as it says, and never more than it may have, whatever is packed in it."""
    size, packed = chunk.uncompressed_size, chunk.data
    if size > min(UNPACKED, max(FREE, RATIO * len(packed))):
        raise Unreadable
    try:
        data: bytes = _UNPACKERS[chunk.compression](packed, size)
    except Exception:  # whatever a library stumbles over, or an unknown way to pack
        raise Unreadable from None
    if len(data) != size or (chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc):
        raise Unreadable
    return data


def _zstd(packed: bytes, size: int) -> bytes:
    import zstandard

    # A window is kept for what was unpacked before.
    return bytes(zstandard.ZstdDecompressor(max_window_size=UNPACKED).stream_reader(packed).read(size + 1))


def _lz4(packed: bytes, size: int) -> bytes:
    import lz4.frame

    return bytes(lz4.frame.LZ4FrameDecompressor().decompress(packed, max_length=size + 1))


_UNPACKERS = {"zstd": _zstd, "lz4": _lz4, "": lambda packed, _: packed}
