"""Frames in a board's bytes, with arrival times."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

from contactfpga.skin import Skin
from contactfpga.skin.derived import Widths
from contactfpga.wire import framing, protocol
from contactfpga.wire.faults import KIND_FAULTS
from contactfpga.wire.protocol import Frame
from contactfpga.wire.units import KIND_UNITS


class ReceivedFrame(NamedTuple):
    """A frame with arrival times on the receiver's clock."""

    frame: Frame
    first: int
    """Time of the first byte."""
    last: int
    """Time of the delimiter."""
    size: int
    """Number of bytes, with the delimiter."""


class Receiver:
    """Splits a board's bytes into packets, reads the frames and counts the hellos."""

    def __init__(self, skin: Skin) -> None:
        self._prefix = protocol.check_prefix(skin)
        self._widths = Widths(skin.sheet)
        self._packet = bytearray()
        self._first = 0
        self.hellos = 0

    def take(self, stream: Iterable[tuple[int, int]]) -> Iterator[ReceivedFrame]:
        """Frames completed by these (time, byte) pairs. Raises :class:`PacketError` for a damaged packet."""
        for time, value in stream:
            if value != framing.DELIMITER:
                self._first = self._first if self._packet else time
                self._packet.append(value)
            elif self._packet:  # else the delimiter before a hello
                packet = bytes(self._packet)
                self._packet.clear()
                plain = framing.unseal(packet, self._prefix)
                kind = framing.kind_of(plain)
                self.hellos += kind == framing.KIND_HELLO
                if kind not in (framing.KIND_HELLO, KIND_FAULTS, KIND_UNITS):
                    frame = protocol.decode_frame(plain, self._widths)
                    yield ReceivedFrame(frame, self._first, time, len(packet) + 1)


def frames_in(skin: Skin, stream: Iterable[tuple[int, int]]) -> Iterator[ReceivedFrame]:
    """Whole frames in the (time, byte) pairs of a board since power-up."""
    return Receiver(skin).take(stream)
