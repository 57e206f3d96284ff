"""One MCAP file, as `contactfpga record` writes it: which boards' bytes it holds, and these."""

from __future__ import annotations

import contextlib
import os
import re
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from contactfpga.driver import mcap_records
from contactfpga.driver.mcap_records import MAGIC, RecordingError, Unreadable
from contactfpga.errors import MissingExtra
from contactfpga.inputs.files import open_regular, told

if TYPE_CHECKING:
    from mcap.records import Channel, ChunkIndex, Schema, Statistics

SUFFIX = ".mcap"
KIND = "contactfpga_msgs/msg/Bytes"
METADATA = "contactfpga"
"""Name of what stands in a file for each link: its hello and its Skin."""

_BEGIN = struct.Struct("<4xiII")
"""Seconds and nanoseconds, and the bytes of the link's name."""
_COUNT = struct.Struct("<I")

MAX_LINKS = 64
MAX_NAME = 256
"""Characters of a link's name: a table of frames has it in each row."""
MAX_TEXTS = 1000
_FOOTER_BYTES = mcap_records.HEAD + 20 + len(MAGIC)
"""At the end of a closed file."""


def numbered(path: Path, number: int) -> Path:
    """A file of a recording to ``path`` that is split."""
    return path.with_name(f"{path.stem}_{number:04d}{path.suffix}")


def files_of(path: Path) -> list[Path]:
    """The files of a recording to ``path``, in order: itself, or if there is no such file those that it was split into.
    Raises :class:`RecordingError` where one of them is missing."""
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
        """Where each link's bytes are."""
        self.start_ns: int = summary.statistics.message_start_time
        """Since 1970."""
        self.end_ns: int = summary.statistics.message_end_time

    def texts(self, name: str) -> list[dict[str, str]]:
        """The texts of this name that are kept beside the messages."""
        from mcap.opcode import Opcode
        from mcap.records import Metadata

        found = []
        with self._opened() as file:
            places = Summary(file).texts
            if len(places) > MAX_TEXTS:
                raise Unreadable
            for data in _each(file, Opcode.METADATA, places):
                text = mcap_records.parsed(Metadata, data)
                found += [text.metadata] if text.name == name else []
        return found

    def read(self, link: str, begin_ns: int | None = None, end_ns: int | None = None) -> Iterator[tuple[int, bytes]]:
        """(when the last byte came, bytes) of a link in order, from a time on and before another one. One chunk is in
        memory at a time."""
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
                for record in mcap_records.inside(mcap_records.parsed(Chunk, data)):
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
    """What stands at the end of a closed file: where its pieces are. Raises :class:`Unreadable`."""

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
        """Where each begins, and its bytes."""
        counted: Statistics | None = None
        end = _file_bytes(file) - _FOOTER_BYTES
        file.seek(max(0, end))
        found = mcap_records.record(file)
        if found is None or found[0] != Opcode.FOOTER or file.read() != MAGIC:
            raise Unreadable
        start = mcap_records.parsed(Footer, found[1]).summary_start
        file.seek(min(start, end) if start else end)
        while file.tell() < end and (found := mcap_records.record(file)) is not None:
            if found[0] not in kinds:
                continue
            one = mcap_records.parsed(kinds[Opcode(found[0])], found[1])
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
        """The type of its messages."""
        return self.schemas[channel.schema_id].name if channel.schema_id in self.schemas else ""


def _each(file: BinaryIO, kind: int, places: list[tuple[int, int]]) -> Iterator[bytes]:
    """Contents of records of this kind that lie at these places, each a beginning and a number of bytes, in order.
    Raises :class:`Unreadable`, also where a piece of the file is named twice: the time for it goes with its size."""
    free = 0
    for at, size in sorted(places):
        if not free <= at <= at + size <= _file_bytes(file):
            raise Unreadable
        file.seek(at)
        found = mcap_records.record(file)
        free = at + size
        if found is None or found[0] != kind or file.tell() != free:
            raise Unreadable
        yield found[1]


def _file_bytes(file: BinaryIO) -> int:
    return os.fstat(file.fileno()).st_size


def data_of(message: bytes) -> bytes:
    """What a message of :data:`KIND` holds."""
    _, _, name = _BEGIN.unpack_from(message)
    at = -(-(_BEGIN.size + name) // 4) * 4
    (count,) = _COUNT.unpack_from(message, at)
    return message[at + 4 : at + 4 + count]
