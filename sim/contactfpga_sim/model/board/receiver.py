"""The frames in what a board sends, each with when its bytes came."""

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
    """A frame, and the times at which its bytes came, in the clock of whoever saw them."""

    frame: Frame
    first: int
    """Of the first byte."""
    last: int
    """Of the delimiter."""
    size: int
    """Bytes, with the delimiter."""


class Receiver:
    """Splits the bytes of a board of this Skin into packets and reads the frames among them; hellos are counted, and
    reports of faults and readings of units passed over."""

    def __init__(self, skin: Skin) -> None:
        self._prefix = protocol.check_prefix(skin)
        self._widths = Widths(skin.sheet)
        self._packet = bytearray()
        self._first = 0
        self.hellos = 0

    def take(self, stream: Iterable[tuple[int, int]]) -> Iterator[ReceivedFrame]:
        """The frames that these (time, byte) pairs complete. Raises :class:`PacketError` for a damaged packet."""
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
    """All whole frames among the (time, byte) pairs that a board of this Skin sent from its power-up on."""
    return Receiver(skin).take(stream)
