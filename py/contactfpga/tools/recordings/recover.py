"""Closes a recording whose program was killed or whose disk was full, by copying all whole parts into a new file."""

from __future__ import annotations

import bisect
import contextlib
import dataclasses
import os
import struct
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

from contactfpga.inputs.files import reason_of, replaced
from contactfpga.tools.recordings.mcap import (
    LARGEST,
    MAGIC,
    Cut,
    Index,
    McapPart,
    Record,
    RecordingError,
    Refused,
    Unpacker,
    Unreadable,
    file_bytes,
    opened,
    parsed,
    records,
)
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
    """Inner pieces omitted because they are damaged."""
    omitted: Counter[str] = dataclasses.field(default_factory=Counter)
    """What else is omitted, by what it is."""
    cut: int = 0
    """Bytes of an incomplete final piece."""
    closed: bool = False
    """Whether the last recording was properly closed."""
    usable: bool = False
    """Whether nothing was left out, and the old file can be read as it is."""
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
    with opened(source) as file:
        if os.path.lexists(target):
            raise RecordingError(f"{target} is there already; name a new file, or remove it first")
        found = RecoveryReport(target)
        try:
            with replaced(target) as new:
                _copy_all(file, new, found)
                found.usable = _usable(source, found)
                if not found.messages:
                    why = ", ".join(f"{count:,} {what}" for what, count in found.omitted.items())
                    raise RecordingError(
                        f"{source} holds {why or 'not one whole message'}; there is nothing to recover"
                    )
        except RecordingFailed as error:
            raise RecordingError(f"{target} cannot be written: {error.reason}; nothing of it is left") from None
        except struct.error:
            raise RecordingError(f"{source} has more channels or schemas than a file can hold") from None
        except OSError as error:
            raise RecordingError(f"{target} cannot be written: {error.strerror or reason_of(error)}") from None
    return found


TOO_LARGE = f"pieces above {LARGEST >> 20} MiB, or beyond what a file of this size may unpack to"


def _copy_all(file: BinaryIO, new: Path, found: RecoveryReport) -> None:
    definitions = _definitions(file)
    new.unlink()  # as it will be made
    copy, unpacker = McapFile(new), Unpacker(file_bytes(file))
    try:
        for number, record in _walk(file, found):
            try:
                for one in unpacker.inside(parsed(record)) if record.kind == "Chunk" else [record]:
                    _take(one, number, definitions[number], copy, found)
            except Refused:
                found.omitted[TOO_LARGE] += 1
            except Unreadable:
                found.damaged += 1
    finally:
        copy.close()
    found.messages, found.seconds = copy.messages, copy.seconds


Definitions = dict[tuple[str, int], Any]
"""Schemas and channels of a recording, by kind and number."""


def _take(record: Record, number: int, known: Definitions, copy: McapFile, found: RecoveryReport) -> None:
    _define(record, known)
    if record.kind == "Attachment":
        found.omitted["attachments"] += 1
    elif record.kind == "Metadata":
        text = parsed(record)
        copy.metadata(text.name, text.metadata)
    elif record.kind == "Message":
        message = parsed(record)
        if (channel := known.get(("Channel", message.channel_id))) is None:
            found.omitted["messages of channels that are not defined"] += 1
        else:
            copy.copy(number, channel, known.get(("Schema", channel.schema_id)), message)


def _define(record: Record, known: Definitions) -> None:
    if record.kind in ("Schema", "Channel"):
        one = parsed(record)
        known[record.kind, one.id] = one


def _usable(source: Path, found: RecoveryReport) -> bool:
    if not found.closed or found.damaged or found.beyond or any(what != "attachments" for what in found.omitted):
        return False
    try:
        part = McapPart(source)
        return all(True for link in part.links for _ in part.read(link))
    except RecordingError:
        return False


def _definitions(file: BinaryIO) -> list[Definitions]:
    """Definitions of each recording; a closed one repeats them at its end, in case its first piece is damaged."""
    found: list[Definitions] = []
    for number, record in _walk(file, RecoveryReport(Path())):
        found += [{} for _ in range(len(found), number + 1)]
        with contextlib.suppress(Unreadable):
            _define(record, found[number])
    return found


def _walk(file: BinaryIO, found: RecoveryReport) -> Iterator[tuple[int, Record]]:
    """Each record with the number of its recording. Whatever does not end where the index says that a chunk begins is
    damaged, and the chunk comes next.
    """
    size, number, at = file_bytes(file), 0, len(MAGIC)
    places = [*_places(file), size]
    while at < size:
        if _magic(file, at):  # another one follows
            number, at = number + 1, at + len(MAGIC)
            found.recordings, found.closed = number + 1, False
        if found.closed:
            found.beyond = size - at
            return
        file.seek(at)
        end = places[min(bisect.bisect_right(places, at), len(places) - 1)]
        try:
            for record in records(file, end):
                yield number, record
                at = record.end
                if record.kind == "Footer":
                    found.closed, at = _magic(file, at), at + len(MAGIC)
                    if not found.closed:
                        found.cut = size - record.at
                        return
                    break
        except Cut as cut:
            if _magic(file, at):
                continue
            if end == size:
                found.cut = cut.size
                return
            found.damaged, at = found.damaged + 1, end


def _magic(file: BinaryIO, at: int) -> bool:
    file.seek(at)
    return file.read(len(MAGIC)) == MAGIC


def _places(file: BinaryIO) -> list[int]:
    """Offsets in bytes of the chunks and of the summary; empty if the file has no complete index."""
    with contextlib.suppress(Unreadable):
        index = Index(file)
        return sorted({*(place.at for place in index.places), index.summary} - {0})
    return []
