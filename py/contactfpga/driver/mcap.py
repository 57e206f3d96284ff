"""Reader of boards' bytes in the MCAP file or files of one `contactfpga record`.

Every read is bounded, because stated sizes may be false.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import struct
import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

from contactfpga.errors import ContactFPGAError, MissingExtra
from contactfpga.inputs.files import open_regular, told
from contactfpga.skin.derived import LONGEST_PACKET
from contactfpga.wire.hello import find_hello

if TYPE_CHECKING:
    from mcap.records import Channel, Chunk, ChunkIndex, Schema, Statistics


MAGIC = b"\x89MCAP0\r\n"
HEAD = 9
LARGEST = 1 << 25
"""Most bytes of a record in the file."""
UNPACKED = 1 << 23
"""Most unpacked bytes of a chunk; ours have 64 KiB or one message, other programs' 4 MiB."""
RATIO = 1000
"""Largest compression ratio of a chunk above :data:`FREE` bytes, which limits a file's time by its size; ours is about
3.
"""
FREE = 1 << 17
_MESSAGE = 22


class RecordingError(ContactFPGAError):
    """A file that is no recording, or one that was not closed."""


class Unreadable(Exception):
    """A record that is damaged or too large."""


class Cut(Unreadable):
    """The file ends within a record; ``size``: its present bytes."""

    def __init__(self, size: int):
        self.size = size


def record(file: BinaryIO) -> tuple[int, bytes] | None:
    """Kind and content of the next record; None at the end of the file. Raises :class:`Cut`."""
    head = file.read(HEAD)
    if not head:
        return None
    size = int.from_bytes(head[1:], "little")
    data = file.read(size) if len(head) == HEAD and size <= LARGEST else b""
    if len(data) < size or len(head) < HEAD:
        raise Cut(len(head) + len(data))
    return head[0], data


def parsed(kind: Any, data: bytes) -> Any:
    """The record as an object of the MCAP library. Raises :class:`Unreadable`."""
    from mcap.data_stream import ReadDataStream

    try:
        return kind.read(ReadDataStream(io.BytesIO(data)))
    except Exception:  # whatever the library stumbles over
        raise Unreadable from None


def inside(chunk: Chunk) -> Iterator[Any]:
    """Messages, channels and schemas of a chunk, in order. Raises :class:`Unreadable` before the first one."""
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
    """The record of a message. Raises :class:`Unreadable`."""
    from mcap.records import Message

    if len(data) < _MESSAGE:
        raise Unreadable
    channel, sequence = int.from_bytes(data[:2], "little"), int.from_bytes(data[2:6], "little")
    logged, published = int.from_bytes(data[6:14], "little"), int.from_bytes(data[14:_MESSAGE], "little")
    return Message(channel, logged, data[_MESSAGE:], published, sequence)


def _unpacked(chunk: Chunk) -> bytes:
    """The chunk's bytes, exactly as many as it states and may have."""
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


SUFFIX = ".mcap"
KIND = "contactfpga_msgs/msg/Bytes"
METADATA = "contactfpga"
"""Name of the metadata with each link's hello and Skin."""

_BEGIN = struct.Struct("<4xiII")
_COUNT = struct.Struct("<I")

MAX_LINKS = 64
MAX_NAME = 256
"""Most characters of a link's name, which tables repeat in each row."""
MAX_TEXTS = 1000
_FOOTER_BYTES = HEAD + 20 + len(MAGIC)


def numbered(path: Path, number: int) -> Path:
    """Path of a numbered file of a recording to ``path`` that is split."""
    return path.with_name(f"{path.stem}_{number:04d}{path.suffix}")


def files_of(path: Path) -> list[Path]:
    """The files of a recording to ``path``, in order: one, or the parts of a split one. Raises :class:`RecordingError`
    if a part is missing.
    """
    if path.suffix != SUFFIX or path.exists():
        return [path]
    form = re.compile(re.escape(path.stem) + r"_(\d{4,})")
    found = (form.fullmatch(one.stem) for one in path.parent.glob(f"*{SUFFIX}"))
    numbers = {int(one[1]) for one in found if one is not None}
    for number in range(1, max(numbers, default=0)):
        if number not in numbers:
            missing = numbered(path, number).name
            raise RecordingError(f"{path}: {missing} is missing; read the other files one by one, by their own names")
    return [numbered(path, number) for number in sorted(numbers)] or [path]


class McapPart:
    """A closed or recovered file."""

    def __init__(self, path: Path):
        self.path = path
        with self._opened() as file:
            summary = Summary(file)
        found = [channel for channel in summary.channels.values() if summary.kind(channel) == KIND]
        names = [channel.metadata.get("link", channel.topic) for channel in found]
        if len(names) > MAX_LINKS or max(map(len, names), default=0) > MAX_NAME:
            raise RecordingError(
                f"{path} has {len(names)} links, the longest name {max(map(len, names))} characters; the limits are "
                f"{MAX_LINKS} and {MAX_NAME}"
            )
        self.topics: dict[str, str] = {name: channel.topic for name, channel in zip(names, found, strict=True)}
        self.start_ns: int = summary.statistics.message_start_time
        self.end_ns: int = summary.statistics.message_end_time

    def texts(self, name: str) -> list[dict[str, str]]:
        """The texts of this name in the metadata."""
        from mcap.opcode import Opcode
        from mcap.records import Metadata

        found = []
        with self._opened() as file:
            places = Summary(file).texts
            if len(places) > MAX_TEXTS:
                raise Unreadable
            for data in _each(file, Opcode.METADATA, places):
                text = parsed(Metadata, data)
                found += [text.metadata] if text.name == name else []
        return found

    def read(self, link: str, begin_ns: int | None = None, end_ns: int | None = None) -> Iterator[tuple[int, bytes]]:
        """(arrival of the last byte in ns, bytes) of a link in order, from ``begin_ns`` up to ``end_ns``, with one
        chunk in memory.
        """
        from mcap.opcode import Opcode
        from mcap.records import Chunk, Message

        begin_ns = 0 if begin_ns is None else begin_ns
        end_ns = 1 << 64 if end_ns is None else end_ns
        if link not in self.topics or self.start_ns >= end_ns or self.end_ns < begin_ns:
            return
        with self._opened() as file:
            summary = Summary(file)
            numbers = {number for number, one in summary.channels.items() if one.topic == self.topics[link]}
            asked = [
                (index.chunk_start_offset, index.chunk_length)
                for index in summary.chunks
                if index.message_end_time >= begin_ns
                and index.message_start_time < end_ns
                # Without a list of them any may be in it.
                and (not index.message_index_offsets or numbers & index.message_index_offsets.keys())
            ]
            del summary
            for data in _each(file, Opcode.CHUNK, asked):
                for record in inside(parsed(Chunk, data)):
                    mine = isinstance(record, Message) and record.channel_id in numbers
                    if mine and begin_ns <= record.log_time < end_ns:
                        yield record.log_time, data_of(record.data)

    @contextlib.contextmanager
    def _opened(self) -> Iterator[BinaryIO]:
        try:
            import mcap.records  # noqa: F401
        except ModuleNotFoundError as error:
            raise MissingExtra(f"{self.path} ({error})", "record") from None
        try:
            file = open_regular(self.path)
        except OSError as error:
            raise RecordingError(f"{self.path} cannot be opened: {error.strerror or told(error)}") from None
        with file:
            if file.read(len(MAGIC)) != MAGIC:
                raise RecordingError(f"{self.path} is no MCAP file")
            try:
                yield file
            except (Unreadable, struct.error, OSError):
                raise RecordingError(
                    f"{self.path} is damaged or was not closed; mend it with: contactfpga record --recover {self.path}"
                ) from None


class Summary:
    """The summary at the end of a closed file. Raises :class:`Unreadable`."""

    def __init__(self, file: BinaryIO):
        from mcap.opcode import Opcode
        from mcap.records import Channel, ChunkIndex, Footer, MetadataIndex, Schema, Statistics

        kinds = {
            Opcode.SCHEMA: Schema,
            Opcode.CHANNEL: Channel,
            Opcode.CHUNK_INDEX: ChunkIndex,
            Opcode.METADATA_INDEX: MetadataIndex,
            Opcode.STATISTICS: Statistics,
        }
        self.schemas: dict[int, Schema] = {}
        self.channels: dict[int, Channel] = {}
        self.chunks: list[ChunkIndex] = []
        self.texts: list[tuple[int, int]] = []
        counted: Statistics | None = None
        end = _file_bytes(file) - _FOOTER_BYTES
        file.seek(max(0, end))
        found = record(file)
        if found is None or found[0] != Opcode.FOOTER or file.read() != MAGIC:
            raise Unreadable
        start = parsed(Footer, found[1]).summary_start
        file.seek(min(start, end) if start else end)
        while file.tell() < end and (found := record(file)) is not None:
            if found[0] not in kinds:
                continue
            one = parsed(kinds[Opcode(found[0])], found[1])
            if isinstance(one, Schema):
                self.schemas[one.id] = one
            elif isinstance(one, Channel):
                self.channels[one.id] = one
            elif isinstance(one, ChunkIndex):
                self.chunks.append(one)
            elif isinstance(one, MetadataIndex):
                self.texts.append((one.offset, one.length))
            else:
                counted = one
        if counted is None:
            raise Unreadable
        self.statistics = counted

    def kind(self, channel: Channel) -> str:
        return self.schemas[channel.schema_id].name if channel.schema_id in self.schemas else ""


def _each(file: BinaryIO, kind: int, places: list[tuple[int, int]]) -> Iterator[bytes]:
    free = 0
    for at, size in sorted(places):
        if not free <= at <= at + size <= _file_bytes(file):
            raise Unreadable
        file.seek(at)
        found = record(file)
        free = at + size
        if found is None or found[0] != kind or file.tell() != free:
            raise Unreadable
        yield found[1]


def _file_bytes(file: BinaryIO) -> int:
    return os.fstat(file.fileno()).st_size


def data_of(message: bytes) -> bytes:
    _, _, name = _BEGIN.unpack_from(message)
    at = -(-(_BEGIN.size + name) // 4) * 4
    (count,) = _COUNT.unpack_from(message, at)
    return message[at + 4 : at + 4 + count]


HELLO_NS = 600_000_000


class McapBytes:
    """A recording whose files were closed or recovered. Calls of :meth:`pieces` are independent."""

    def __init__(self, path: str | Path):
        self.path = Path(path)
        self._parts = [McapPart(one) for one in files_of(self.path)]
        held = {link for part in self._parts for link in part.topics}
        added = [facts.get("link", "") for facts in self.texts(METADATA)]
        self._links = sorted(held, key=lambda link: (added.index(link) if link in added else len(added), link))
        if not self._links:
            raise RecordingError(f"{path} holds no bytes of a board; `contactfpga record` makes files that do")
        parts = [part for part in self._parts if part.topics]
        self.start_ns = min(part.start_ns for part in parts)
        self.end_ns = max(part.end_ns for part in parts)

    @property
    def links(self) -> list[str]:
        """Names of the links, in order of addition."""
        return list(self._links)

    def checked(self, link: str | None) -> str:
        """The link of this name; None: the only one. Raises :class:`RecordingError`."""
        if link is None and len(self._links) == 1:
            return self._links[0]
        if link in self._links:
            return link
        names = ", ".join(self._links)
        if link is None:
            raise RecordingError(f"{self.path} holds several links; name one of them: {names}")
        raise RecordingError(f"{self.path} has no link {link!r}; it has {names}")

    def texts(self, name: str) -> list[dict[str, str]]:
        found: list[dict[str, str]] = []
        for part in self._parts:
            found += [one for one in part.texts(name) if one not in found]
        return found

    def pieces(self, link: str | None = None, start_ns: int | None = None) -> Iterator[tuple[int, bytes]]:
        """(arrival of the last byte in ns, bytes) of a link, in order: from the last hello that arrived by
        ``start_ns``, or from the beginning.
        """
        link = self.checked(link)
        if start_ns is None:
            yield from self._read(link)
            return
        begin_ns, at = start_ns, -1
        for begin_ns in (start_ns - HELLO_NS, start_ns - 8 * HELLO_NS, self.start_ns):
            if (at := _last_hello(self._read(link, begin_ns, start_ns + 1))) >= 0:
                break
        yield from _after(self._read(link, begin_ns, start_ns + 1), max(0, at))
        yield from self._read(link, start_ns + 1)

    def _read(self, link: str, begin_ns: int | None = None, end_ns: int | None = None) -> Iterator[tuple[int, bytes]]:
        for part in self._parts:
            yield from part.read(link, begin_ns, end_ns)


class McapStream:
    """The bytes of one link as a readable stream."""

    def __init__(self, path: str | Path, link: str | None, start_s: float):
        file = McapBytes(path)
        start_ns = file.start_ns + round(start_s * 1e9)
        if start_ns > file.end_ns:
            lasts_s = (file.end_ns - file.start_ns) / 1e9
            raise RecordingError(f"{path} lasts {lasts_s:.3f} s; it cannot start at {start_s:g} s")
        self._pieces = file.pieces(file.checked(link), start_ns if start_s else None)
        self._piece, self._taken = b"", 0

    def read(self, count: int) -> bytes:
        """At most ``count`` bytes; b"" at the end."""
        while self._taken >= len(self._piece):
            if (piece := next(self._pieces, None)) is None:
                return b""
            self._piece, self._taken = piece[1], 0
        data = self._piece[self._taken : self._taken + count]
        self._taken += count
        return data

    def close(self) -> None:
        self._pieces.close()  # type: ignore[attr-defined]


def _last_hello(pieces: Iterable[tuple[int, bytes]]) -> int:
    found, before, held = -1, 0, b""
    for _, data in pieces:
        data = held + data
        if (at := find_hello(data, last=True)) >= 0:
            found = before + at
        held = data[data.rfind(0) + 1 :][-LONGEST_PACKET:]
        before += len(data) - len(held)
    return found


def _after(pieces: Iterable[tuple[int, bytes]], at: int) -> Iterator[tuple[int, bytes]]:
    for moment, data in pieces:
        if at < len(data):
            yield moment, data[at:]
        at = max(0, at - len(data))
