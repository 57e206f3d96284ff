"""Closes a recording whose program was killed or whose disk was full: copies all that is whole into a new file."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

from contactfpga.driver.mcap_part import LARGEST, MAGIC, RecordingError
from contactfpga.errors import MissingExtra
from contactfpga.inputs.files import open_regular, told
from contactfpga.recordings.mcap_file import McapFile

_HEAD = 9
"""Bytes before a record: what it is, and how long."""


@dataclasses.dataclass
class Recovered:
    """What was found."""

    path: Path
    """The new file."""
    messages: int = 0
    seconds: float = 0.0
    """From the first message to the last one."""
    damaged: int = 0
    """Pieces in the middle that were left out."""
    cut: int = 0
    """Bytes of a piece at the end that is not whole."""
    closed: bool = False
    """It was closed as it should be."""


def recover(path: str | Path, into: str | Path | None = None) -> Recovered:
    """Copy what is whole into a new file, by default ``touches_recovered.mcap`` for ``touches.mcap``; the old one stays
    as it is. Raises :class:`RecordingError` where there is nothing to copy, or a file of the new one's name."""
    source = Path(path)
    target = source.parent / f"{source.stem}_recovered{source.suffix}" if into is None else Path(into)
    try:
        file = open_regular(source)
    except OSError as error:
        raise RecordingError(f"{source} cannot be opened: {error.strerror or told(error)}") from None
    with file:
        if file.read(len(MAGIC)) != MAGIC:
            raise RecordingError(f"{source} is no MCAP file")
        found = Recovered(target)
        copy = _Copy(target, *_definitions(file))
        file.seek(len(MAGIC))
        try:
            for record in _records(file, found):
                copy.take(record, found)
        finally:
            copy.close()
    if not found.messages:
        target.unlink()
        raise RecordingError(f"{source} holds not one whole message; there is nothing to recover")
    return found


class _Copy:
    """The new file."""

    def __init__(self, path: Path, schemas: dict[int, Any], channels: dict[int, Any]):
        self._file = McapFile(path)
        self._schemas, self._channels = dict(schemas), dict(channels)
        self._first_ns: int | None = None

    def take(self, record: Any, found: Recovered) -> None:
        """Add a record of the old one."""
        from mcap.records import Channel, Message, Metadata, Schema

        if isinstance(record, Metadata):
            self._file.metadata(record.name, record.metadata)
        elif isinstance(record, Schema):
            self._schemas[record.id] = record
        elif isinstance(record, Channel):
            self._channels[record.id] = record
        elif isinstance(record, Message) and record.channel_id in self._channels:
            channel = self._channels[record.channel_id]
            self._file.copy(channel, self._schemas.get(channel.schema_id), record.log_time, record.data)
            self._first_ns = record.log_time if self._first_ns is None else self._first_ns
            found.messages += 1
            found.seconds = max(found.seconds, (record.log_time - self._first_ns) / 1e9)

    def close(self) -> None:
        self._file.close()


def _definitions(file: BinaryIO) -> tuple[dict[int, Any], dict[int, Any]]:
    """Schemas and channels, which a closed file repeats at its end: else all is lost where their first piece is
    damaged. None where it has no end."""
    try:
        from mcap.reader import SeekingReader

        file.seek(0)
        summary = SeekingReader(file).get_summary()
    except Exception:  # whatever the library stumbles over in a file without an end, or where it is not installed
        summary = None
    return ({}, {}) if summary is None else (summary.schemas, summary.channels)


def _records(file: BinaryIO, found: Recovered) -> Iterator[Any]:
    """Records up to the end of the data, or of what is whole."""
    try:
        from mcap.data_stream import ReadDataStream
        from mcap.opcode import Opcode
        from mcap.records import Channel, Chunk, Metadata, Schema
        from mcap.stream_reader import breakup_chunk
    except ModuleNotFoundError as error:
        raise MissingExtra(f"recovering a recording ({error})", "record") from None
    import io

    kinds = {Opcode.METADATA: Metadata, Opcode.SCHEMA: Schema, Opcode.CHANNEL: Channel, Opcode.CHUNK: Chunk}
    while head := file.read(_HEAD):
        kind, size = head[0], int.from_bytes(head[1:], "little")
        if kind == Opcode.DATA_END:
            found.closed = True
            return
        data = file.read(size) if len(head) == _HEAD and size <= LARGEST else b""
        if len(data) < size or len(head) < _HEAD:
            found.cut = len(head) + len(data)
            return
        if kind not in kinds:
            continue
        try:
            record = kinds[kind].read(ReadDataStream(io.BytesIO(data)))
            inside = breakup_chunk(record, validate_crc=True) if kind == Opcode.CHUNK else [record]
        except Exception:  # whatever the library stumbles over in a piece that is damaged
            found.damaged += 1
            continue
        yield from inside
