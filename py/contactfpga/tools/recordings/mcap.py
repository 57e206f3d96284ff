"""Reader of boards' bytes in an MCAP file.

Classes of the MCAP library read each record. Where records are and how much is unpacked is decided here, because the
library's readers believe stated sizes, and keep every chunk that they were asked for.
"""

from __future__ import annotations

import collections
import contextlib
import io
import os
import re
import struct
import zlib
from collections.abc import Iterable, Iterator, Set
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple

from contactfpga.driver.address import MAX_LINKS, MAX_NAME
from contactfpga.errors import ContactFPGAError, MissingExtra
from contactfpga.inputs.files import open_regular, reason_of
from contactfpga.inputs.values import shell_words

if TYPE_CHECKING:
    from mcap.records import Channel, Chunk, ChunkIndex, Schema


MAGIC = b"\x89MCAP0\r\n"
HEAD = 9
LARGEST = 1 << 26
"""Most bytes of a record, and of an unpacked chunk; ours have 64 KiB or one message, other programs' 1 to 32 MiB."""
FREE = 1 << 26
RATIO = 1000
"""What a file unpacks to has at most FREE bytes and RATIO times its size; ours has up to 7 times its size."""
LEAST = 1 << 11
"""Bytes that each unpacked record counts at least, because each takes time; of that, ours use a tenth of the limit."""
KINDS = {2: "Footer", 3: "Schema", 4: "Channel", 5: "Message", 6: "Chunk"}
KINDS |= {8: "ChunkIndex", 9: "Attachment", 11: "Statistics", 12: "Metadata", 13: "MetadataIndex"}
"""The MCAP library's class for each kind of record that matters here."""


class RecordingError(ContactFPGAError):
    """A file that is no recording, or one that was not closed."""


class Unreadable(Exception):
    """Why a file cannot be read; ``{recover}`` in the text stands for the command that mends it."""

    def __init__(self, why: str = "is damaged; mend it with: {recover}"):
        super().__init__(why)


class Refused(Unreadable):
    """The file is whole, but beyond a limit or ambiguous."""


class Cut(Unreadable):
    """The records end within one; ``size``: its present bytes."""

    def __init__(self, size: int):
        super().__init__()
        self.size = size


class Record(NamedTuple):
    """A record from ``at`` to ``end``; ``kind``: of :data:`KINDS`, or empty; no ``data`` if too large."""

    at: int
    end: int
    kind: str
    data: bytes


def records(file: BinaryIO, end: int) -> Iterator[Record]:
    """Records from where the file stands up to ``end``. Raises :class:`Cut`."""
    at = file.tell()
    while at < end:
        head = file.read(HEAD)
        size = int.from_bytes(head[1:], "little")
        stop = at + HEAD + size
        if stop > end:
            raise Cut(end - at)
        kind = KINDS.get(head[0], "")
        used = kind not in ("", "Attachment") and size <= LARGEST
        yield Record(at, stop, kind, file.read(size) if used else b"")
        at = stop
        file.seek(at)


def parsed(record: Record) -> Any:
    """The record as an object of the MCAP library. Raises :class:`Unreadable`."""
    from mcap import records as classes
    from mcap.data_stream import ReadDataStream

    if (size := record.end - record.at - HEAD) > LARGEST:
        raise _too_large(record.kind, size)
    stream = ReadDataStream(io.BytesIO(record.data))
    try:
        read = getattr(classes, record.kind).read
        return read(stream, size) if record.kind == "Message" else read(stream)
    except Exception:  # whatever the library stumbles over
        raise Unreadable from None


def _too_large(kind: str, size: int) -> Refused:
    what, step = ("chunk", "with smaller chunks") if kind == "Chunk" else ("record", "without it")
    return Refused(f"has a {what} of {size / 2**20:,.1f} MiB; the limit is {LARGEST >> 20} MiB; write it {step}")


class Unpacker:
    """Unpacks the chunks of a file of ``size`` bytes, as far as its size allows."""

    def __init__(self, size: int):
        self._most = self._left = FREE + RATIO * size

    def inside(self, chunk: Chunk) -> Iterator[Record]:
        """Records of a chunk, in order. Raises :class:`Unreadable`, for a damaged chunk before the first one."""
        size, packed = chunk.uncompressed_size, chunk.data
        if size > LARGEST:
            raise _too_large("Chunk", size)
        if size > self._left:
            raise self._too_much()
        try:
            data: bytes = _UNPACKERS[chunk.compression](packed, size)
        except Exception:  # whatever a library stumbles over, or an unknown way to pack
            raise Unreadable from None
        if len(data) != size or (chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc):
            raise Unreadable
        for record in records(io.BytesIO(data), size):
            self._left -= max(LEAST, record.end - record.at)
            if self._left < 0:
                raise self._too_much()
            yield record

    def each(self, file: BinaryIO, end: int) -> Iterator[Record]:
        """:func:`records`, with those of a chunk in its place."""
        for record in records(file, end):
            if record.kind == "Chunk":
                yield from self.inside(parsed(record))
            else:
                yield record

    def _too_much(self) -> Refused:
        return Refused(
            f"unpacks to more than {self._most >> 20:,} MiB, the limit for its size (each record counts at least "
            f"{LEAST >> 10} KiB); split it"
        )


def _zstd(packed: bytes, size: int) -> bytes:
    import zstandard

    # A window is kept for what was unpacked before.
    return bytes(zstandard.ZstdDecompressor(max_window_size=LARGEST).stream_reader(packed).read(size + 1))


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


class Place(NamedTuple):
    """Bytes of a file with messages of these channels and times."""

    at: int
    end: int
    start_ns: int
    end_ns: int
    channels: Set[int]


class Index:
    """What is where in a closed file: by its summary or, if that leaves something out, by all its records. Raises
    :class:`Unreadable`.
    """

    def __init__(self, file: BinaryIO):
        self._end = file_bytes(file) - _FOOTER_BYTES
        file.seek(max(0, self._end))
        footer = next(records(file, self._end + _FOOTER_BYTES - len(MAGIC)), None) if self._end > 0 else None
        if footer is None or footer.kind != "Footer" or file.read() != MAGIC:
            raise Unreadable("was not closed; mend it with: {recover}")
        self.summary = parsed(footer).summary_start
        self._clear()
        try:
            if not (self.summary and self._by_summary(file)):
                self._clear()
                self._by_records(file)
        except Unreadable as error:
            if not isinstance(error, Refused):
                _check_single(file, self._end)
            raise

    def _clear(self) -> None:
        self.schemas: dict[int, Schema] = {}
        self.channels: dict[int, Channel] = {}
        self.places: list[Place] = []
        self.texts: list[tuple[int, int]] = []
        self._sets: dict[Set[int], Set[int]] = {}

    def kind(self, channel: Channel) -> str:
        return self.schemas[channel.schema_id].name if channel.schema_id in self.schemas else ""

    def _by_summary(self, file: BinaryIO) -> bool:
        """Whether the summary tells all."""
        counted = None
        file.seek(min(self.summary, self._end))
        for record in records(file, self._end):
            if record.kind in ("ChunkIndex", "MetadataIndex", "Statistics"):
                one = parsed(record)
                if record.kind == "Statistics":
                    counted = one.channel_count, one.chunk_count, one.metadata_count
                elif record.kind == "MetadataIndex":
                    self.texts.append((one.offset, one.offset + one.length))
                else:
                    self._add(one.chunk_start_offset, one.chunk_length, one, one.message_index_offsets)
            else:
                self._defined(record)
        schemas = {channel.schema_id for channel in self.channels.values()} - {0}
        known = all(place.channels and place.channels <= self.channels.keys() for place in self.places)
        whole = counted in (None, (len(self.channels), len(self.places), len(self.texts)))
        return bool(self.places) and known and whole and schemas <= self.schemas.keys()

    def _by_records(self, file: BinaryIO) -> None:
        unpacker = Unpacker(file_bytes(file))
        loose: list[int] = []  # first and last time of messages outside of chunks
        file.seek(len(MAGIC))
        for record in records(file, self._end):
            if record.kind == "Chunk":
                chunk = parsed(record)
                if inside := {_channel(one) for one in unpacker.inside(chunk) if self._defined(one)}:
                    self._add(record.at, record.end - record.at, chunk, inside)
            elif record.kind == "Metadata":
                self.texts.append((record.at, record.end))
            elif self._defined(record):
                ns = parsed(record).log_time
                loose = [min([ns, *loose]), max([ns, *loose])]
        if loose:
            times = [ns for place in self.places for ns in place[2:4]] + loose
            self.places = [Place(len(MAGIC), self._end, min(times), max(times), self.channels.keys())]

    def _add(self, at: int, size: int, of: ChunkIndex | Chunk, channels: Iterable[int]) -> None:
        times = of.message_start_time, of.message_end_time
        found = frozenset(channels)
        self.places.append(Place(at, at + size, *times, self._sets.setdefault(found, found)))  # many are equal

    def _defined(self, record: Record) -> bool:
        """Whether a record is a message; definitions are kept. Raises :class:`Unreadable` for another file's end."""
        if record.kind == "Footer":
            raise Unreadable
        if record.kind in ("Schema", "Channel"):
            one = parsed(record)
            (self.schemas if record.kind == "Schema" else self.channels)[one.id] = one
        return record.kind == "Message"


def _channel(message: Record) -> int:
    return int.from_bytes(message.data[:2], "little")


def _check_single(file: BinaryIO, end: int) -> None:
    file.seek(len(MAGIC))
    with contextlib.suppress(Cut):
        if any(record.kind == "Footer" for record in records(file, end)):
            raise Unreadable("holds several recordings, one after the other; join them with: {recover}")


_MIXED = (
    "mixes bytes of several boards named {!r}, as merging does; give them different names, or read each recording alone"
)


class McapPart:
    """A closed or recovered file."""

    def __init__(self, path: Path):
        self.path = path
        with self._opened() as file:
            index = Index(file)
        self._texts = index.texts
        found: dict[tuple[str, str], set[int]] = {}
        for number, channel in index.channels.items():
            if index.kind(channel) == KIND:
                found.setdefault((channel.metadata.get("link", channel.topic), channel.topic), set()).add(number)
        shared = collections.Counter(link for link, _ in found)
        names = [link if shared[link] == 1 else topic for link, topic in found]
        if len(names) > MAX_LINKS or max(map(len, names), default=0) > MAX_NAME:
            raise RecordingError(
                f"{path} has {len(names)} links, the longest name {max(map(len, names))} characters; the limits are "
                f"{MAX_LINKS} and {MAX_NAME}"
            )
        self.links: dict[str, set[int]] = dict(zip(names, found.values(), strict=True))
        """Channels of each link; links of one name, as of boards that were merged, are named by their topics."""
        if len(self.links) < len(names):
            raise RecordingError(f"{path} holds links that share names and topics; record them under different names")
        self.start_ns = min((place.start_ns for place in index.places), default=0)
        self.end_ns = max((place.end_ns for place in index.places), default=0)
        ours = set().union(*self.links.values())
        self._places = [place for place in index.places if not ours.isdisjoint(place.channels)]

    def texts(self, name: str) -> list[dict[str, str]]:
        """The texts of this name in the metadata."""
        found = []
        with self._opened() as file:
            if len(self._texts) > MAX_TEXTS:
                raise Refused(f"has {len(self._texts):,} texts; the limit is {MAX_TEXTS:,}")
            for at, end in _apart(file, self._texts):
                for record in records(file, end):
                    text = parsed(record) if record.kind == "Metadata" else None
                    if text is None or record.at != at:
                        raise Unreadable
                    found += [text.metadata] if text.name == name else []
        return found

    def read(self, link: str, begin_ns: int | None = None, end_ns: int | None = None) -> Iterator[tuple[int, bytes]]:
        """(arrival of the last byte in ns, bytes) of a link in order, from ``begin_ns`` up to ``end_ns``, with one
        chunk in memory.
        """
        begin_ns = 0 if begin_ns is None else begin_ns
        end_ns = 1 << 64 if end_ns is None else end_ns
        if link not in self.links or self.start_ns >= end_ns or self.end_ns < begin_ns:
            return
        channels = self.links[link]
        asked = [
            (place.at, place.end)
            for place in self._places
            if place.end_ns >= begin_ns and place.start_ns < end_ns and not channels.isdisjoint(place.channels)
        ]
        with self._opened() as file:
            unpacker = Unpacker(file_bytes(file))
            due, left, gone = (-1, 0), collections.deque[tuple[int, int]](maxlen=MAX_LINKS), set[int]()
            for _, end in _apart(file, asked):
                for record in unpacker.each(file, end):
                    if record.kind == "Message" and _channel(record) in channels:
                        message = parsed(record)
                        if (now := (message.channel_id, message.sequence)) != due:
                            # One goes on where another one came in between; old recordings have no sequence.
                            if now in left or (now[0] != due[0] and now[0] in gone):
                                raise Refused(_MIXED.format(link))
                            left.append(due)
                            gone.add(due[0])
                        due = message.channel_id, message.sequence + 1
                        if begin_ns <= message.log_time < end_ns:
                            yield message.log_time, data_of(message.data)

    @contextlib.contextmanager
    def _opened(self) -> Iterator[BinaryIO]:
        with opened(self.path) as file:
            try:
                yield file
            except (Unreadable, struct.error, OSError) as error:
                why = str(error if isinstance(error, Unreadable) else Unreadable())
                recover = shell_words("contactfpga", "record", "--recover", self.path)
                raise RecordingError(f"{self.path} {why.replace('{recover}', recover)}") from None


@contextlib.contextmanager
def opened(path: Path) -> Iterator[BinaryIO]:
    """An MCAP file at its first record. Raises :class:`RecordingError`, :class:`MissingExtra`."""
    try:
        import mcap.records  # noqa: F401
    except ModuleNotFoundError as error:
        raise MissingExtra(f"{path} ({error})", "record") from None
    try:
        file = open_regular(path)
    except OSError as error:
        raise RecordingError(f"{path} cannot be opened: {error.strerror or reason_of(error)}") from None
    with file:
        if file.read(len(MAGIC)) != MAGIC:
            raise RecordingError(f"{path} is no MCAP file")
        yield file


def _apart(file: BinaryIO, places: list[tuple[int, int]]) -> Iterator[tuple[int, int]]:
    """These places in order, with the file at each. Raises :class:`Unreadable` if one is in the way of another."""
    free = 0
    for at, end in sorted(places):
        if not free <= at < end <= file_bytes(file):
            raise Unreadable
        file.seek(at)
        yield at, end
        free = end


def file_bytes(file: BinaryIO) -> int:
    return os.fstat(file.fileno()).st_size


def data_of(message: bytes) -> bytes:
    _, _, name = _BEGIN.unpack_from(message)
    at = -(-(_BEGIN.size + name) // 4) * 4
    (count,) = _COUNT.unpack_from(message, at)
    return message[at + 4 : at + 4 + count]
