"""An MCAP file under construction, with whole pieces only, even if the program or the disk fails."""

from __future__ import annotations

import collections
import contextlib
import errno
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from contactfpga.errors import ContactFPGAError, MissingExtra
from contactfpga.inputs.files import reason_of
from contactfpga.inputs.values import shell_words
from contactfpga.robot.ros.types import schema

if TYPE_CHECKING:
    from mcap.records import Channel, Message, Schema


class RecordingFailed(ContactFPGAError):
    """A recording could not be continued; its written part is whole. ``reason``: why."""

    def __init__(self, message: str, reason: str):
        super().__init__(message)
        self.reason = reason


class WholeFile:
    """A new file that writes the bytes up to each :meth:`flush` together, or on failure none of them."""

    def __init__(self, path: Path):
        self.path = path
        self.holds_messages = False
        """Whether what is written so far can be recovered."""
        self._whole = 0
        self._waiting = bytearray()
        try:
            self._descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666)
        except FileExistsError:
            reason = "is there already; name a new file, or remove it first"
            raise RecordingFailed(f"{path} {reason}", reason) from None
        except OSError as error:
            reason = error.strerror or reason_of(error)
            raise RecordingFailed(f"{path} cannot be written: {reason}", reason) from None

    def tell(self) -> int:
        return self._whole + len(self._waiting)

    def write(self, data: bytes) -> int:
        self._waiting += data
        return len(data)

    def flush(self) -> None:
        """Pass buffered bytes to the system, which keeps them if this program dies."""
        left = memoryview(bytes(self._waiting))
        self._waiting.clear()
        count = len(left)
        try:
            while left:
                left = left[os.write(self._descriptor, left) :]
        except OSError as error:
            raise self._failed(error) from None
        self._whole += count

    def close(self) -> None:
        """Close the file without buffered bytes; may be called twice."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1

    def _failed(self, error: OSError) -> RecordingFailed:
        full = error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
        reason = f"there is no room for more ({error.strerror})" if full else error.strerror or reason_of(error)
        if not self.holds_messages:
            self.close()
            with contextlib.suppress(OSError):
                self.path.unlink()
            return RecordingFailed(f"{self.path}: {reason}; nothing was recorded. Make room, then record again", reason)
        with contextlib.suppress(OSError):
            os.ftruncate(self._descriptor, self._whole)
        recover = shell_words("contactfpga", "record", "--recover", self.path)
        return RecordingFailed(
            f"{self.path}: {reason}; the {self._whole:,} bytes that are there are whole. "
            f"Make room, then close the file with: {recover}",
            reason,
        )


CHUNK_BYTES = 1 << 16
FLUSH_S = 0.1
"""Most waiting bytes, and their longest wait: half of the promised loss if the program dies, as the system may delay a
write.
"""
_MESSAGE_BYTES = 31


class McapFile:
    """One file, for a single thread."""

    def __init__(self, path: Path):
        try:
            from mcap.writer import CompressionType, Writer
        except ModuleNotFoundError as error:
            raise MissingExtra(f"a recording ({error})", "record") from None
        self.path = path
        self.messages = 0
        self._first_ns = self._last_ns = 0
        self._failed = False
        self._file = WholeFile(path)
        # Chunks end where we say so.
        self._writer = Writer(self._file, chunk_size=1 << 40, compression=CompressionType.ZSTD)
        self._writer.start(profile="ros2", library="contactfpga")
        self._schemas: dict[object, int] = {}
        self._channels: dict[object, int] = {}
        self._written: collections.Counter[int] = collections.Counter()  # messages of each channel
        self._waiting = 0
        self._since_s = math.inf
        self.flush()

    @property
    def seconds(self) -> float:
        return (self._last_ns - self._first_ns) / 1e9

    @property
    def size(self) -> int:
        """Bytes in the file, and buffered ones before compression."""
        return self._file.tell() + self._waiting

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        self._writer.add_metadata(name, dict(values))
        self.flush()

    def write(self, topic: str, kind: str, link: str | None, time_ns: int, data: bytes, now_s: float) -> None:
        """Add a message of a type such as ``contactfpga_msgs/Zones``; ``now_s`` is from ``time.monotonic``."""
        self._make_room(data)
        channel = self._channels.get((topic, link, kind))
        if channel is None:
            package, _, short = kind.partition("/")
            name, metadata = f"{package}/msg/{short}", {} if link is None else {"link": link}
            text = self._schema(name, "ros2msg", schema(kind).encode())
            channel = self._writer.register_channel(topic, "cdr", text, metadata)
            self._channels[topic, link, kind] = channel
        self._add(channel, time_ns, data, self._written[channel])
        self._since_s = min(self._since_s, now_s)
        self.flush_old(now_s)

    def copy(self, recording: int, channel: Channel, of: Schema | None, message: Message) -> None:
        """Add a message of another file; each channel of each of its recordings stays one."""
        self._make_room(message.data)
        key = recording, channel.id, channel.topic
        number = self._channels.get(key)
        if number is None:
            text = 0 if of is None else self._schema(of.name, of.encoding, of.data)
            number = self._writer.register_channel(channel.topic, channel.message_encoding, text, channel.metadata)
            self._channels[key] = number
        self._add(number, message.log_time, message.data, message.sequence)

    def _make_room(self, data: bytes) -> None:
        if self._waiting and self._waiting + len(data) + _MESSAGE_BYTES > CHUNK_BYTES:
            self.flush()

    def _add(self, channel: int, time_ns: int, data: bytes, sequence: int) -> None:
        self._writer.add_message(channel, time_ns, data, time_ns, sequence % (1 << 32))
        self._written[channel] += 1
        self._waiting += len(data) + _MESSAGE_BYTES
        self._first_ns = min(self._first_ns, time_ns) if self.messages else time_ns
        self._last_ns = max(self._last_ns, time_ns)
        self.messages += 1

    def flush_old(self, now_s: float) -> None:
        """Write buffered messages if they are old enough."""
        if now_s - self._since_s >= FLUSH_S:
            self.flush()

    def flush(self) -> None:
        self._waiting, self._since_s = 0, math.inf
        if not self._failed:
            self._failed = True  # until it is written
            self._writer.flush()
            self._failed, self._file.holds_messages = False, self.messages > 0

    def close(self) -> None:
        """Write buffered messages and the index; may be called twice."""
        try:
            if not self._failed:
                self._failed = True  # whatever comes of it, there is no second time
                self._waiting = 0
                self._writer.finish()
                self._file.flush()
        finally:
            self._file.close()

    def _schema(self, name: str, encoding: str, text: bytes) -> int:
        key = (name, encoding, text)
        if key not in self._schemas:
            self._schemas[key] = self._writer.register_schema(name, encoding, text)
        return self._schemas[key]
