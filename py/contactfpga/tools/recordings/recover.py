"""Closes a recording whose program was killed or whose disk was full, by copying all whole parts into a new file."""

from __future__ import annotations

import contextlib
import dataclasses
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

from contactfpga.driver import mcap
from contactfpga.driver.mcap import MAGIC, Cut, RecordingError, Summary, Unreadable
from contactfpga.errors import MissingExtra
from contactfpga.inputs.files import open_regular, replaced, told
from contactfpga.tools.recordings.mcap_file import McapFile, RecordingFailed


@dataclasses.dataclass
class RecoveryReport:
    """Result of a recovery."""

    path: Path
    """The new file."""
    messages: int = 0
    seconds: float = 0.0
    """Seconds from the first message to the last one."""
    damaged: int = 0
    """Inner pieces omitted because they are damaged or too large."""
    cut: int = 0
    """Bytes of an incomplete final piece."""
    closed: bool = False
    """Whether the last recording was properly closed."""
    recordings: int = 1
    """Consecutive recordings in the file."""
    beyond: int = 0
    """Trailing bytes that are no recording."""


def recover(path: str | Path, into: str | Path | None = None) -> RecoveryReport:
    """Copy the whole parts into a new file, by default ``touches_recovered.mcap`` for ``touches.mcap``, which appears
    once complete. Raises :class:`RecordingError` if there is nothing to copy, no room, or such a file already.
    """
    source = Path(path)
    target = source.parent / f"{source.stem}_recovered{source.suffix}" if into is None else Path(into)
    try:
        file = open_regular(source)
    except OSError as error:
        raise RecordingError(f"{source} cannot be opened: {error.strerror or told(error)}") from None
    try:
        import mcap.records  # noqa: F401
    except ModuleNotFoundError as error:
        raise MissingExtra(f"recovering a recording ({error})", "record") from None
    with file:
        if file.read(len(MAGIC)) != MAGIC:
            raise RecordingError(f"{source} is no MCAP file")
        if os.path.lexists(target):
            raise RecordingError(f"{target} is there already; name a new file, or remove it first")
        found = RecoveryReport(target)
        try:
            with replaced(target) as new:
                _copy_all(file, new, found)
                if not found.messages:
                    raise RecordingError(f"{source} holds not one whole message; there is nothing to recover")
        except RecordingFailed as error:
            raise RecordingError(f"{target} cannot be written: {error.reason}; nothing of it is left") from None
        except OSError as error:
            raise RecordingError(f"{target} cannot be written: {error.strerror or told(error)}") from None
    return found


def _copy_all(file: BinaryIO, new: Path, found: RecoveryReport) -> None:
    definitions = _definitions(file)
    new.unlink()  # as it will be made
    copy = _Copy(new)
    try:
        for number, kind, data in _walk(file, found):
            if number >= len(copy.definitions):
                copy.definitions.append(definitions[number])
            try:
                for record in _inside(kind, data):
                    copy.take(record, found)
            except Unreadable:
                found.damaged += 1
    finally:
        copy.close()
    try:
        Summary(file)
    except Unreadable:
        found.closed = False


class _Definitions:
    def __init__(self) -> None:
        self.schemas: dict[int, Any] = {}
        self.channels: dict[int, Any] = {}

    def take(self, record: Any) -> None:
        from mcap.records import Channel, Schema

        if isinstance(record, Schema):
            self.schemas[record.id] = record
        elif isinstance(record, Channel):
            self.channels[record.id] = record


class _Copy:
    def __init__(self, path: Path):
        self._file = McapFile(path)
        self.definitions: list[_Definitions] = []
        """Definitions of each recording so far; the last one's numbers count."""
        self._first_ns: int | None = None

    def take(self, record: Any, found: RecoveryReport) -> None:
        from mcap.records import Message, Metadata

        known = self.definitions[-1]
        known.take(record)
        if isinstance(record, Metadata):
            self._file.metadata(record.name, record.metadata)
        elif isinstance(record, Message) and record.channel_id in known.channels:
            channel = known.channels[record.channel_id]
            self._file.copy(channel, known.schemas.get(channel.schema_id), record.log_time, record.data)
            self._first_ns = record.log_time if self._first_ns is None else self._first_ns
            found.messages += 1
            found.seconds = max(found.seconds, (record.log_time - self._first_ns) / 1e9)

    def close(self) -> None:
        self._file.close()


def _definitions(file: BinaryIO) -> list[_Definitions]:
    """Definitions of each recording; a closed one repeats them at its end, in case its first piece is damaged."""
    from mcap.opcode import Opcode

    found: list[_Definitions] = []
    for number, kind, data in _walk(file, counts := RecoveryReport(Path())):
        found += [_Definitions() for _ in range(len(found), number + 1)]
        if kind in (Opcode.SCHEMA, Opcode.CHANNEL):
            with contextlib.suppress(Unreadable):
                for record in _inside(kind, data):
                    found[number].take(record)
    if len(found) == 1 and counts.cut:  # it may have an end all the same
        with contextlib.suppress(Unreadable):
            summary = Summary(file)
            found[0].schemas, found[0].channels = dict(summary.schemas), dict(summary.channels)
    return found


def _walk(file: BinaryIO, found: RecoveryReport) -> Iterator[tuple[int, int, bytes]]:
    from mcap.opcode import Opcode

    number = 0
    file.seek(len(MAGIC))
    while True:
        at = file.tell()
        head = file.read(len(MAGIC))
        if head == MAGIC:  # another one follows
            number += 1
            found.recordings, found.closed = number + 1, False
            continue
        file.seek(at)
        if found.closed:
            found.beyond = os.fstat(file.fileno()).st_size - at
            return
        try:
            one = mcap.record(file)
        except Cut as cut:
            found.cut = cut.size
            return
        if one is None:
            return
        yield number, *one
        if one[0] == Opcode.FOOTER:
            found.closed = file.read(len(MAGIC)) == MAGIC
            if not found.closed:
                found.cut = os.fstat(file.fileno()).st_size - at
                return


def _inside(kind: int, data: bytes) -> Iterator[Any]:
    from mcap.opcode import Opcode
    from mcap.records import Channel, Chunk, Metadata, Schema

    if kind == Opcode.CHUNK:
        yield from mcap.inside(mcap.parsed(Chunk, data))
    elif kind == Opcode.MESSAGE:
        yield mcap.message(data)
    elif kind in (kinds := {Opcode.METADATA: Metadata, Opcode.SCHEMA: Schema, Opcode.CHANNEL: Channel}):
        yield mcap.parsed(kinds[Opcode(kind)], data)
