"""Where hellos begin in a board's bytes: what comes from there on can be read alone."""

from __future__ import annotations

from contactfpga.skin.derived import CHECK_BYTES
from contactfpga.wire import framing
from contactfpga.wire.framing import PacketError
from contactfpga.wire.hello import SHEET


def begins_hello(packet: bytes) -> bool:
    """Whether a packet, without delimiters, is a hello or the first one of several."""
    if len(packet) < framing.SHORTEST_PACKET:
        return False
    if packet[-CHECK_BYTES - 1] >> framing.FLAG_BITS != framing.KIND_HELLO:  # quicker than the check
        return False
    try:
        return framing.unseal(packet, b"")[0] == SHEET
    except PacketError:
        return False


def find_hello(data: bytes, last: bool = False) -> int:
    """Where the first, or the ``last``, whole hello in ``data`` begins; -1: there is none."""
    found, start = -1, 0
    while (end := data.find(0, start)) >= 0:
        if begins_hello(data[start:end]):
            if not last:
                return start
            found = start
        start = end + 1
    return found


class Cutter:
    """Cuts a stream of bytes at its next hello."""

    def __init__(self) -> None:
        self.held = b""
        """The beginning of a packet that is not whole."""

    def take(self, data: bytes) -> tuple[bytes, bytes]:
        """Bytes before the cut, and after it, which is empty as long as no hello has come."""
        data = self.held + data
        at = find_hello(data)
        if at >= 0:
            self.held = b""
            at -= data[max(0, at - 2) : at].count(0) == min(at, 2) > 0  # a hello has a delimiter at either end
            return data[:at], data[at:]
        end = data.rfind(0) + 1
        self.held = data[end:]
        return data[:end], b""
