"""Python binding, by ctypes, of the C thread that reads ports (c/reader.c).

A plain C library needs no build for each Python version; the installation compiles it if there is a C compiler
(hatch_build.py). Only waiting calls release the interpreter's lock, so a thread that has waited copies the newest frame
of that time.
"""

from __future__ import annotations

import ctypes
import functools
import os
import struct
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from contactfpga.driver import forks
from contactfpga.driver.address import Serial, parse
from contactfpga.driver.clock import ClockFit
from contactfpga.driver.reads import READ, Reads
from contactfpga.skin.derived import Widths
from contactfpga.skin.sheet import Sheet as SheetFacts
from contactfpga.wire import table
from contactfpga.wire.protocol import Frame, frame_of
from contactfpga.wire.table import FIELDS, PacketTable
from contactfpga.zones.units import UnitHistory
from contactfpga.zones.zone import HostLine, Zones

LIBRARY = Path(__file__).with_name("_reader.so")

CHUNK = 16_384

_WORD = 8
_TAKEN = struct.Struct("8Q")
_LINE = struct.Struct("qddd")
_NEWEST = struct.Struct("Qqqdqddd")
_FRAME = struct.Struct("?7x8q")
_NEWEST_AND_FRAME = struct.Struct("Qqqdqddd?7x8q")


FrameFormat = tuple[Widths, bytes]
"""Widths of frames, and first bytes of their check."""


class Sheet(ctypes.Structure):
    """Format of frames for the decoder."""

    _fields_ = [
        (name, ctypes.c_uint32)
        for name in (
            *("known", "rows", "columns", "connectivity", "report"),
            *("fraction_bits", "closed", "extent", "levels", "zone_capacity", "prefix"),
        )
    ]

    @classmethod
    def of(cls, widths: Widths, before: bytes) -> Sheet:
        sheet = widths.sheet
        report = ("moments", "cells", "barycenter").index(sheet.report)
        return cls(
            *(1, sheet.rows, sheet.columns, sheet.connectivity, report, sheet.barycenter_bits, sheet.closed),
            *(sheet.extent, sheet.levels),
            *(sheet.zone_capacity, int.from_bytes(before, "little")),
        )


class Base(ctypes.Structure):
    """State after the taken packets; see :meth:`Port.settle`."""

    _fields_ = [
        ("steady", ctypes.c_int64),
        ("packets", ctypes.c_uint64),
        ("time_us", ctypes.c_int64),
        ("heard", ctypes.c_int64),
        ("came_s", ctypes.c_double),
        ("byte_s", ctypes.c_double),
    ]


class Steady(NamedTuple):
    """The meaning of frames while they change only counters and clocks, because each continues the last one."""

    time_us: int
    """Time of :attr:`before` since power-up."""
    before: Frame
    came_s: float
    """Arrival of :attr:`before`, on the host's clock."""
    fit: ClockFit
    byte_s: float
    sheet: SheetFacts
    faults: tuple[str, ...]
    history: UnitHistory | None

    def zones(self, frame: Frame, time_us: int, before: Frame, line: HostLine) -> Zones:
        """Zones of a frame, without counting it; ``before`` is the frame just before it."""
        return Zones(frame, self.sheet, time_us, before, line, self.faults, self.history)


class Newest(NamedTuple):
    packets: int
    """Number of the frame's packet since the port was opened, from 1."""
    time_us: int
    """Time of the frame in us since power-up."""
    after_another: bool
    """Whether the frame before it, :meth:`Port.before`, came after :meth:`Port.settle`."""
    line: HostLine
    frame: Frame


class Library:
    def __init__(self, path: Path):
        keeps, releases = ctypes.PyDLL(str(path)), ctypes.CDLL(str(path), use_errno=True)
        address, double, number = ctypes.c_void_p, ctypes.c_double, ctypes.c_uint64

        def function(library: ctypes.CDLL, name: str, result: Any, *arguments: Any) -> Callable[..., Any]:
            found = getattr(library, f"cfpga_{name}")
            found.restype, found.argtypes = result, arguments
            return found  # type: ignore[no-any-return]

        self.open = function(releases, "open", address, ctypes.c_int, double)
        self.close = function(releases, "close", None, address)
        self.wait = function(releases, "wait", None, address, number, ctypes.c_int, double)
        self.free = function(keeps, "free", None, address)
        self.wake = function(keeps, "wake", None, address)
        self.forked = function(keeps, "forked", None)
        self.feed = function(keeps, "feed", None, address, ctypes.c_char_p, ctypes.c_size_t, double)
        self.sheet = function(keeps, "sheet", None, address, ctypes.POINTER(Sheet))
        decoded = ctypes.POINTER(Sheet), ctypes.c_char_p, ctypes.c_size_t, address, address, address
        self.decode = function(keeps, "decode", None, *decoded)
        self.waiting = function(keeps, "waiting", ctypes.c_size_t, address)
        self.notice = function(keeps, "notice", ctypes.c_int, address, double)
        self.failure = function(keeps, "failure", ctypes.c_int, address)
        self.take = function(keeps, "take", None, address, address, ctypes.c_size_t)
        self.settle = function(keeps, "settle", None, address, ctypes.POINTER(Base), address)
        self.newest = function(keeps, "newest", ctypes.c_int, address, number, address)
        self.fit_size = function(keeps, "fit_size", ctypes.c_size_t)
        self.fit_begin = function(keeps, "fit_begin", None, address)
        self.fit_forget = function(keeps, "fit_forget", None, address)
        self.fit_arrived = function(keeps, "fit_arrived", None, address, ctypes.c_size_t, *[address] * 4)
        self.fit_answered = function(keeps, "fit_answered", None, address, ctypes.c_int64, double)
        self.fit_line = function(keeps, "fit_line", ctypes.c_int, address, address)


@functools.lru_cache(maxsize=1)
def library() -> Library:
    found = Library(LIBRARY)
    forks.in_child(found.forked)
    return found


def missing() -> str:
    if os.name != "posix":
        return "it needs Linux or macOS"
    if not LIBRARY.exists():
        return "it was installed without a C compiler; install one, then the package again"
    try:
        library()
    except (OSError, AttributeError) as error:  # or it is of an older c/reader.c
        return f"its library cannot be loaded ({error}); install the package again"
    return ""


def refusal(port: object) -> str:
    """Reason why the C thread cannot read a port; "" if it can."""
    if not isinstance(port, str) or not isinstance(parse(port), Serial):
        return "only the bytes of a serial port come by themselves, from a descriptor that C can read"
    return missing()


@functools.lru_cache(maxsize=1)
def _compiled() -> bool:
    return not missing()


def decode(packets: Sequence[bytes], widths: Widths, before: bytes) -> PacketTable:
    """:func:`contactfpga.wire.table.decode` in C, except for bitmaps, and without the library."""
    if not widths.report.zones or not _compiled():
        return table.decode(packets, widths, before)
    data, columns = b"\0".join([*packets, b""]), len(widths.record_bits)
    count = data.count(0)
    found, starts = np.empty(count, FIELDS), np.empty(count + 1, np.int64)
    records = np.empty((len(data) // widths.record_bytes, columns), np.int64)
    sheet = Sheet.of(widths, before)
    library().decode(sheet, data, len(data), found.ctypes.data, starts.ctypes.data, records.ctypes.data)
    return PacketTable(found, starts, records[: starts[-1]])


class NativeFit(ClockFit):
    """A :class:`~contactfpga.driver.clock.ClockFit` in C, which the reading thread continues."""

    def __init__(self) -> None:
        self._library = library()
        self.memory = ctypes.create_string_buffer(self._library.fit_size())
        self._next = ctypes.create_string_buffer(_LINE.size)
        self._library.fit_begin(self.memory)

    def forget(self) -> None:
        self._library.fit_forget(self.memory)

    def arrived(self, time_us: int, arrived_s: float, wire_s: float) -> None:
        host = (ctypes.c_double * 2)(arrived_s, wire_s)
        self._library.fit_arrived(
            self.memory, 1, ctypes.byref(ctypes.c_int64(time_us)), host, ctypes.byref(host, _WORD), None
        )

    def answered(self, time_us: int, asked_s: float) -> None:
        self._library.fit_answered(self.memory, time_us, asked_s)

    def arrived_in_turn(
        self, times_us: np.ndarray, arrived_s: np.ndarray, wire_s: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        came = times_us.astype(np.int64), arrived_s.astype(float), wire_s.astype(float)  # in one piece each
        lines = np.empty((len(times_us), 4))
        self._library.fit_arrived(self.memory, len(lines), *(values.ctypes.data for values in (*came, lines)))
        return lines.view(np.int64)[:, 0], lines[:, 1], lines[:, 2], lines[:, 3]

    @property
    def begun(self) -> bool:
        return bool(self._library.fit_line(self.memory, self._next))

    def line(self, arrived_s: float) -> HostLine | None:
        return HostLine(arrived_s, *_LINE.unpack(self._next)) if self.begun else None


class Port:
    """A port that the C thread reads, or with descriptor -1 gets from :meth:`feed`."""

    def __init__(self, descriptor: int, now: float):
        self._library, self._inherited = library(), False
        self._address = self._library.open(descriptor, now)
        if not self._address:
            raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
        self._decodes: FrameFormat | None = None
        self._columns, self._room = 3, 0
        self.taken = 0
        """Packets taken so far, including overwritten ones."""
        self._bytes = 0  # the same
        self._make_room()
        forks.watch(self)

    def forked(self) -> None:
        self._inherited = True

    def __del__(self) -> None:
        if self._mine():
            address, self._address = self._address, None  # what ends with it may still call wake() or close()
            self._library.close(address)
            self._library.free(address)

    def _mine(self) -> bool:
        return bool(getattr(self, "_address", None)) and not self._inherited

    def close(self) -> None:
        """Stop reading and wake waiting threads. May be called twice."""
        if self._mine():
            self._library.close(self._address)

    def wake(self) -> None:
        """Wake waiting threads, now and later."""
        if self._mine():
            self._library.wake(self._address)

    def feed(self, data: bytes, now: float) -> None:
        """Take bytes in place of the thread, at most :data:`CHUNK`; for tests."""
        self._library.feed(self._address, data, len(data), now)

    def wait(self, packets: int, seconds: float) -> None:
        """Wait for more than ``packets`` packets since the port was opened, for the port's end, or for ``seconds``."""
        self._library.wait(self._address, packets, 0, seconds)

    def wait_for_much(self, seconds: float) -> None:
        """:meth:`wait` until a ring is a quarter full."""
        self._library.wait(self._address, 0, 1, seconds)

    def paused(self, now: float) -> bool:
        """Whether frame times are ambiguous since the last read."""
        return bool(self._library.notice(self._address, now))

    @property
    def failure(self) -> int:
        """errno of a lost port, -1 at its end, 0 while it works."""
        return int(self._library.failure(self._address))

    def decode(self, frame_format: FrameFormat | None) -> None:
        """Set the frame format; see :attr:`contactfpga.driver.conversation.Conversation.frame_format`."""
        if frame_format is not None and not frame_format[0].report.zones:
            frame_format = None
        if frame_format == self._decodes:
            return
        sheet, self._columns = Sheet(), 3
        if frame_format is not None:
            sheet = Sheet.of(*frame_format)
            self._columns, self._room = len(frame_format[0].record_bits), frame_format[0].max_items
        self._make_room()
        self._library.sheet(self._address, ctypes.byref(sheet))
        self._decodes = frame_format

    def _make_room(self) -> None:
        self._newest = np.zeros(_NEWEST.size + 2 * FIELDS.itemsize + 2 * self._room * self._columns * _WORD, np.uint8)
        self._newest_view = self._newest.data
        self._newest_at = self._newest.ctypes.data

    # ---- what came

    def take(self) -> tuple[Reads, bytes, int] | None:
        """All waiting reads, the beginning of their first packet if it was overwritten, and the number of overwritten
        bytes; None if nothing waits.
        """
        if not (size := self._library.waiting(self._address)):
            return None
        memory = np.empty(size, np.uint8)
        self._library.take(self._address, memory.ctypes.data, size)
        count, packets, records, length, partial, gap, first_packet, first_byte = _TAKEN.unpack_from(memory.data)
        if not count:
            return None
        columns = self._columns
        reads = _TAKEN.size
        fields = reads + count * READ.itemsize
        starts = fields + packets * FIELDS.itemsize
        sizes = starts + (packets + 1) * _WORD
        carried = sizes + packets * _WORD
        begun = carried + records * columns * _WORD
        data, end = begun + partial, begun + partial + length
        packet_table = None
        if self._decodes is not None:
            rows = np.frombuffer(memory, np.int64, records * columns, carried).reshape(-1, columns)
            found = np.frombuffer(memory, FIELDS, packets, fields)
            packet_table = PacketTable(found, np.frombuffer(memory, np.int64, packets + 1, starts), rows)
        came = Reads(
            first_byte,
            first_packet,
            np.frombuffer(memory, READ, count, reads),
            memory[data:end].tobytes(),
            self._decodes,
            packet_table,
            np.frombuffer(memory, np.int64, packets, sizes),
        )
        missing = first_byte - self._bytes if gap else 0
        self.taken, self._bytes = first_packet + packets, first_byte + length
        return came, memory[begun:data].tobytes(), missing

    # ---- the newest frame

    def settle(self, steady: Steady | None) -> None:
        """Set the state after the taken packets, from :meth:`contactfpga.driver.conversation.Conversation.steady`."""
        base, memory = Base(packets=self.taken), None
        if steady is not None and isinstance(steady.fit, NativeFit):
            memory = steady.fit.memory
            base.steady, base.time_us, base.heard = 1, steady.time_us, steady.before.heard
            base.came_s, base.byte_s = steady.came_s, steady.byte_s
        self._library.settle(self._address, ctypes.byref(base), memory)

    def newest(self, packets: int) -> Newest | None:
        """The newest frame; None unless it is newer than packet ``packets``. Raises :class:`NewestUnknown` if received
        packets have to be taken first. Not thread-safe.
        """
        found = self._library.newest(self._address, packets, self._newest_at)
        if found <= 0:
            if found:
                raise NewestUnknown
            return None
        values = _NEWEST_AND_FRAME.unpack_from(self._newest_view)
        frame = self._frame(values[8:], _NEWEST.size + 2 * FIELDS.itemsize)
        return Newest(values[0], values[1], values[2] == 1, HostLine._make(values[3:8]), frame)

    def before(self) -> Frame:
        """The frame before that of the last :meth:`newest`."""
        first, second = _FRAME.iter_unpack(self._newest_view[_NEWEST.size : _NEWEST.size + 2 * FIELDS.itemsize])
        return self._frame(second, _NEWEST.size + 2 * FIELDS.itemsize + first[-1] * self._columns * _WORD)

    def _frame(self, fields: tuple[int, ...], start: int) -> Frame:
        assert self._decodes is not None
        shape = fields[-1], self._columns
        copied = bytearray(self._newest_view[start : start + shape[0] * shape[1] * _WORD])
        return frame_of(fields, np.ndarray(shape, np.int64, copied), self._decodes[0].sheet)


class NewestUnknown(Exception):
    """The newest frame is unknown until received packets are taken."""
