"""One MCAP file, as `contactfpga record` writes it: which boards' bytes it holds, and these."""

from __future__ import annotations

import contextlib
import re
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from contactfpga.errors import ContactFPGAError, MissingExtra
from contactfpga.inputs.files import open_regular, told

if TYPE_CHECKING:
    from mcap.summary import Summary

MAGIC = b"\x89MCAP0\r\n"
SUFFIX = ".mcap"
KIND = "contactfpga_msgs/msg/Bytes"
METADATA = "contactfpga"
"""Name of what stands in a file for each link: its hello and its Skin."""

_BEGIN = struct.Struct("<4xiII")
"""Seconds and nanoseconds, and the bytes of the link's name."""
_COUNT = struct.Struct("<I")

LARGEST = 1 << 28
"""Bytes of a record."""


class RecordingError(ContactFPGAError):
    """A file that is no recording, or one that was not closed."""


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
        summary = self._summary()
        found = [channel for channel in summary.channels.values() if self._is_bytes(summary, channel.schema_id)]
        self.topics: dict[str, str] = {channel.metadata.get("link", channel.topic): channel.topic for channel in found}
        """Where each link's bytes are."""
        statistics = summary.statistics
        self.start_ns: int = statistics.message_start_time if statistics else 0
        """Since 1970."""
        self.end_ns: int = statistics.message_end_time if statistics else 0

    def texts(self, name: str) -> list[dict[str, str]]:
        """The texts of this name that are kept beside the messages."""
        with self._opened() as reader:
            return [dict(one.metadata) for one in reader.iter_metadata() if one.name == name]

    def read(self, link: str, begin_ns: int | None = None, end_ns: int | None = None) -> Iterator[tuple[int, bytes]]:
        """(when the last byte came, bytes) of a link in order, from a time on and before another one."""
        if link not in self.topics or (end_ns is not None and self.start_ns >= end_ns):
            return
        if begin_ns is not None and self.end_ns < begin_ns:
            return
        with self._opened() as reader:
            for _, _, message in reader.iter_messages(
                [self.topics[link]], starting_at=begin_ns, ending_before=end_ns, log_time_order=False
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


def data_of(message: bytes) -> bytes:
    """What a message of :data:`KIND` holds."""
    _, _, name = _BEGIN.unpack_from(message)
    at = -(-(_BEGIN.size + name) // 4) * 4
    (count,) = _COUNT.unpack_from(message, at)
    return message[at + 4 : at + 4 + count]
