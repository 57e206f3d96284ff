"""A FlexiTac sheet at a serial port, whose data are converted to the packets of a board.

FlexiTac is an open sheet of 16x32 resistive cells (https://flexitac.github.io). Its firmware sends, at 2,000,000 baud
and about 100 times per second, the bytes AA 55 and a reading from 0 to 255 of each cell, row by row. Frames have no
numbers, times or checks, so a frame counts only if the next one's AA 55 follows it.
"""

from __future__ import annotations

import dataclasses
import re
from collections import Counter
from itertools import pairwise

import numpy as np

from contactfpga.driver.address import FLEXITAC_LIMITS, Flexitac
from contactfpga.driver.transport import SerialTransport
from contactfpga.errors import BoardSilent, OnlyNoise, ReadTimeout
from contactfpga.skin import Skin
from contactfpga.skin.derived import EPOCH_BITS, HEARD_BITS, SEQUENCE_BITS, TIME_BITS, Widths
from contactfpga.wire import framing
from contactfpga.wire.framing import DELIMITER, KINDS, PacketError
from contactfpga.wire.protocol import HEARD_DIGITS, KIND_REQUEST, REQUEST_HELLO, check_prefix, encode_hello

MARK = b"\xaa\x55"
BITS_PER_BYTE = 10
DAMAGED = b"\x01\x00"
"""Packet in place of bytes that are no frame; it counts as damaged."""


class Framer:
    """Cuts bytes into frames of ``size`` readings; buffers at most two frames."""

    def __init__(self, size: int):
        self._size = size + len(MARK)
        self._rest = b""

    def take(self, data: bytes) -> list[bytes | None]:
        """The readings of all frames that ``data`` completes; None in place of bytes that are no frame."""
        data = self._rest + data
        found: list[bytes | None] = []
        while len(data) >= self._size + len(MARK):
            if data.startswith(MARK) and data.startswith(MARK, self._size):
                found.append(data[len(MARK) : self._size])
                data = data[self._size :]
                continue
            if not found or found[-1] is not None:
                found.append(None)
            begins = data.find(MARK, 1)
            data = data[begins:] if begins > 0 else data[-1:]
        self._rest = data
        return found


class Cells:
    """Compares readings with the rest: a cell is pressed while it reads at least ``margin`` above its median in the
    first frames.
    """

    def __init__(self, shape: tuple[int, int], frames: int, margin: int):
        self._shape, self._frames, self._margin = shape, frames, margin
        self._first: list[np.ndarray] = []
        self._from: np.ndarray | None = None

    def take(self, readings: bytes) -> np.ndarray | None:
        """(rows, columns) bool; None while the rest is unknown."""
        values = np.frombuffer(readings, np.uint8).reshape(self._shape)
        if self._from is None:
            self._first.append(values)
            if len(self._first) == self._frames:
                self._from = np.median(self._first, axis=0) + self._margin
                self._first = []
            return None
        pressed: np.ndarray = values >= self._from
        return pressed


@dataclasses.dataclass
class LastRequest:
    """The last request, and how many more frames may have begun before it."""

    number: int = 0
    older: int = 0
    shown: int = 0
    """Request number in current frames."""


KEPT_BYTES = 16_384
"""Number of last bytes that say why no frame came: four of the largest frames."""

HELLO_US = 500_000
"""Interval of hellos, by which a network reader knows the time after a break."""


class FlexitacPort:
    """The port ``flexitac://PORT``. Raises the errors of a serial port, and :class:`AddressError`."""

    live = threaded = True

    def __init__(self, name: str):
        address = Flexitac.parse(name)
        shape = address.rows, address.columns
        self.name = name
        self._skin = Skin(
            rows=address.rows,
            columns=address.columns,
            pitch_x_mm=address.pitch_mm,
            pitch_y_mm=address.pitch_mm,
            report="cells",
            baud=address.baud,
        )
        self._widths = Widths(self._skin.sheet)
        self._framer = Framer(address.rows * address.columns)
        self._cells = Cells(shape, address.frames, address.margin)
        self._frame_s = (address.rows * address.columns + len(MARK)) * BITS_PER_BYTE / address.baud
        self._request = LastRequest()
        self._sent = 0
        self._out = bytearray()
        self._port = SerialTransport(address.device, address.baud)
        self._begun_s = self._came_s = self._port.clock()
        self._last = b""
        self._time_us = self._greeted_us = 0

    def read(self, timeout_s: float) -> bytes:
        data = self._port.read(0.0 if self._out else timeout_s)
        if data:
            self._came_s, self._last = self._port.clock(), (self._last + data)[-KEPT_BYTES:]
        frames = self._framer.take(data) if data else []
        now_us = int((self._port.clock() - self._begun_s) * 1e6)
        for number, readings in enumerate(frames):
            later = (len(frames) - number) * self._frame_s
            self._take(readings, max(self._time_us + 1, now_us - int(later * 1e6)))
        if self._sent and self._time_us - self._greeted_us >= HELLO_US:
            self._greeted_us = self._time_us
            self._greet(self._time_us, self._request.shown)
        found = bytes(self._out)
        self._out.clear()
        return found

    def _take(self, readings: bytes | None, time_us: int) -> None:
        if readings is None:
            self._out += DAMAGED
            return
        cells = self._cells.take(readings)
        self._request.older -= 1
        if self._request.older == 0:
            self._request.shown = self._request.number
        self._time_us = time_us
        if cells is not None:
            self._out += self._packet(cells)
            self._sent += 1

    def write(self, data: bytes) -> None:
        """The sheet itself gets nothing."""
        for packet in data.split(bytes([DELIMITER])):
            try:
                plain = framing.unseal(packet, b"")
            except PacketError:
                continue  # the same request as pulses, or a command
            if framing.kind_of(plain) != KIND_REQUEST:
                continue
            # Of the frames that come next one is on its way already, and one may wait in the adapter.
            self._request = LastRequest(framing.number(plain[:HEARD_DIGITS]), 3, self._request.shown)
            if plain[-1] & REQUEST_HELLO:
                self._greet(int((self._port.clock() - self._begun_s) * 1e6), self._request.number)

    def _greet(self, time_us: int, heard: int) -> None:
        self._out += encode_hello(self._skin, self._sent, time_us >> EPOCH_BITS, heard)

    def _packet(self, cells: np.ndarray) -> bytes:
        widths = self._widths
        room = np.zeros((len(cells), 8 * widths.bitmap_row_bytes), bool)
        room[:, : cells.shape[1]] = cells
        word, low = 0, 0
        fields = (
            (self._time_us, TIME_BITS),
            (self._sent, SEQUENCE_BITS),
            (self._request.shown, HEARD_BITS),
            (int(cells.sum()), widths.area_bits),
        )
        for value, bits in fields:
            word |= (value & (1 << bits) - 1) << low
            low += bits
        body = np.packbits(room, axis=1, bitorder="little").tobytes()
        body += word.to_bytes(widths.trailer_bytes - 1, "little") + bytes([framing.last_byte(KINDS["cells"])])
        return framing.seal(body, check_prefix(self._skin))

    def no_frame(self, timeout_s: float) -> ReadTimeout:
        """The error where no frame came within ``timeout_s`` seconds, by what the sheet itself sent."""
        head, skin = f"{self.name}: no frame within {timeout_s:g} s", self._skin
        if self._port.clock() - self._came_s >= timeout_s:
            return BoardSilent(f"{head}, not one byte came; is the sheet powered, and is this its port?")
        gap = _usual_gap(self._last)
        rows, rest = divmod(gap - len(MARK), skin.columns)
        if gap == skin.rows * skin.columns + len(MARK):
            return ReadTimeout(f"{head}; the first frames tell how cells read at rest; give it a longer timeout")
        if rows < 1:
            fault = f"no AA 55 comes again and again; is {skin.baud} the sheet's baud rate? If not, add baud=N"
        elif rest or rows > FLEXITAC_LIMITS["rows"][1]:
            fault = f"AA 55 comes every {gap} bytes, no rows of {skin.columns}; add rows=N and columns=N of the sheet"
        else:
            fault = f"AA 55 comes every {gap} bytes: {rows} rows of {skin.columns}? If so, add rows={rows}"
        return OnlyNoise(f"{head}; bytes came, but {fault}")

    def clock(self) -> float:
        return self._port.clock()

    def close(self) -> None:
        self._port.close()


def _usual_gap(data: bytes) -> int:
    """The most frequent distance in bytes from one mark to the next; 0 if it is not that of half of them."""
    places = [found.start() for found in re.finditer(re.escape(MARK), data)]
    gaps = Counter(later - earlier for earlier, later in pairwise(places))
    ((gap, count),) = gaps.most_common(1) or [(0, 0)]
    return gap if count > 1 and 2 * count >= gaps.total() else 0
