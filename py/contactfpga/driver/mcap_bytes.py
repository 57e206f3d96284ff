"""Reads the bytes of boards out of an MCAP file, as `contactfpga record` writes it."""

from __future__ import annotations

import contextlib
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from contactfpga.errors import ContactFPGAError, MissingExtra
from contactfpga.inputs.files import open_regular, told
from contactfpga.wire.hellos import find_hello

if TYPE_CHECKING:
    from mcap.summary import Summary

MAGIC = b"\x89MCAP0\r\n"
KIND = "contactfpga_msgs/msg/Bytes"

_BEGIN = struct.Struct("<4xiII")
"""Seconds and nanoseconds, and the bytes of the link's name."""
_COUNT = struct.Struct("<I")

LARGEST = 1 << 28
"""Bytes of a record."""
HELLO_NS = 600_000_000
"""Hellos come twice per second."""


class RecordingError(ContactFPGAError):
    """A file that is no recording, or one that was not closed."""


class McapBytes:
    """A closed or recovered file. Each :meth:`pieces` reads on its own."""

    def __init__(self, path: str | Path):
        self.path = Path(path)
        summary = self._summary()
        found = [channel for channel in summary.channels.values() if self._is_bytes(summary, channel.schema_id)]
        self._topics: dict[str, str] = {channel.metadata.get("link", channel.topic): channel.topic for channel in found}
        if not self._topics:
            raise RecordingError(f"{path} holds no bytes of a board; `contactfpga record` makes files that do")
        statistics = summary.statistics
        self.start_ns: int = statistics.message_start_time if statistics else 0
        """Since 1970."""
        self.end_ns: int = statistics.message_end_time if statistics else 0

    @property
    def links(self) -> list[str]:
        """Names of the links whose bytes it holds."""
        return list(self._topics)

    def topic(self, link: str | None) -> str:
        """Where a link's bytes are; None: of the only one. Raises :class:`RecordingError`."""
        if link is None and len(self._topics) == 1:
            return next(iter(self._topics.values()))
        if link in self._topics:
            return self._topics[link]
        names = ", ".join(self.links)
        if link is None:
            raise RecordingError(f"{self.path} holds several links; name one of them: {names}")
        raise RecordingError(f"{self.path} has no link {link!r}; it has {names}")

    def texts(self, name: str) -> list[dict[str, str]]:
        """The texts of this name that are kept beside the messages."""
        with self._opened() as reader:
            return [dict(one.metadata) for one in reader.iter_metadata() if one.name == name]

    def pieces(self, link: str | None = None, start_ns: int | None = None) -> Iterator[tuple[int, bytes]]:
        """(when the last byte came, bytes) of a link, in order; with ``start_ns`` from the last hello on that had come
        by then, or from the beginning."""
        topic = self.topic(link)
        if start_ns is None:
            yield from self._read(topic)
            return
        begin_ns = start_ns
        for begin_ns in (start_ns - HELLO_NS, start_ns - 8 * HELLO_NS, self.start_ns):
            pieces = list(self._read(topic, begin_ns, start_ns + 1))
            if (at := find_hello(b"".join(data for _, data in pieces), last=True)) >= 0:
                yield from _after(pieces, at)
                break
        else:
            yield from pieces
        yield from self._read(topic, start_ns + 1)

    def _read(self, topic: str, begin_ns: int | None = None, end_ns: int | None = None) -> Iterator[tuple[int, bytes]]:
        with self._opened() as reader:
            for _, _, message in reader.iter_messages(
                [topic], starting_at=begin_ns, ending_before=end_ns, log_time_order=False
            ):
                yield message.log_time, data_of(message.data)

    def _summary(self) -> Summary:
        with self._opened() as reader:
            summary = reader.get_summary()
            if summary is None or summary.statistics is None:
                raise self._damaged()
            return summary

    def _damaged(self) -> RecordingError:
        return RecordingError(
            f"{self.path} is damaged or was not closed; mend it with: contactfpga recover {self.path}"
        )

    @contextlib.contextmanager
    def _opened(self):  # type: ignore[no-untyped-def]
        try:
            from mcap.reader import SeekingReader
        except ModuleNotFoundError as error:
            raise MissingExtra(f"{self.path} ({error})", "record") from None
        try:
            file = open_regular(self.path)
        except OSError as error:
            raise RecordingError(f"{self.path} cannot be opened: {error.strerror or told(error)}") from None
        with file:
            if file.read(len(MAGIC)) != MAGIC:
                raise RecordingError(f"{self.path} is no MCAP file")
            file.seek(0)
            try:
                yield SeekingReader(file, validate_crcs=True, record_size_limit=LARGEST)
            except ContactFPGAError:
                raise
            except Exception:  # whatever the library stumbles over
                raise self._damaged() from None

    @staticmethod
    def _is_bytes(summary: Summary, schema: int) -> bool:
        return schema in summary.schemas and summary.schemas[schema].name == KIND


class McapStream:
    """The bytes of one link, to be read like a file."""

    def __init__(self, path: str | Path, link: str | None, start_s: float):
        file = McapBytes(path)
        start_ns = file.start_ns + round(start_s * 1e9)
        if start_ns > file.end_ns:
            lasts_s = (file.end_ns - file.start_ns) / 1e9
            raise RecordingError(f"{path} lasts {lasts_s:.3f} s; it cannot start at {start_s:g} s")
        self._pieces = file.pieces(link, start_ns if start_s else None)
        file.topic(link)
        self._rest = b""

    def read(self, count: int) -> bytes:
        """At most ``count`` bytes; b"" at the end."""
        while not self._rest:
            if (piece := next(self._pieces, None)) is None:
                return b""
            self._rest = piece[1]
        data, self._rest = self._rest[:count], self._rest[count:]
        return data

    def close(self) -> None:
        """Let the file go."""
        self._pieces.close()  # type: ignore[attr-defined]


def data_of(message: bytes) -> bytes:
    """What a message of :data:`KIND` holds."""
    _, _, name = _BEGIN.unpack_from(message)
    at = -(-(_BEGIN.size + name) // 4) * 4
    (count,) = _COUNT.unpack_from(message, at)
    return message[at + 4 : at + 4 + count]


def _after(pieces: list[tuple[int, bytes]], at: int) -> Iterator[tuple[int, bytes]]:
    """The pieces without their first ``at`` bytes."""
    for moment, data in pieces:
        if at < len(data):
            yield moment, data[at:]
        at = max(0, at - len(data))
