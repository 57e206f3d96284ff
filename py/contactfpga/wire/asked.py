"""What bytes to a board ask for, for who passes them on and must not pass on everything."""

from __future__ import annotations

import enum

from contactfpga.wire.command import KIND_COMMAND, VALUE_DIGITS, WHAT_DIGITS
from contactfpga.wire.framing import DELIMITER, PacketError, kind_of, unseal
from contactfpga.wire.hello import HEARD_DIGITS
from contactfpga.wire.protocol import KIND_REQUEST

_MARK, _ONE, _ZERO = 0xF0, 0xFF, 0x00
"""Of pulses: :func:`contactfpga.wire.framing.pulses`."""
_SIZES = {KIND_REQUEST: HEARD_DIGITS + 1, KIND_COMMAND: HEARD_DIGITS + WHAT_DIGITS + VALUE_DIGITS + 1}
"""Plain bytes of each."""


class Asked(enum.Enum):
    """The most that is among them."""

    REQUEST = "requests for a frame or a hello, which change nothing"
    COMMAND = "a command"
    OTHER = "something that no host sends"


def asked_in(data: bytes) -> Asked:
    """What these bytes, which must be whole packets, ask for."""
    found = Asked.REQUEST if data else Asked.OTHER
    while data:
        mark = data[0]
        end = data.find(mark, 1)
        if mark not in (DELIMITER, _MARK) or end < 0:
            return Asked.OTHER
        packet, data = data[1:end], data[end + 1 :]
        try:
            plain = unseal(packet if mark == DELIMITER else _without_pulses(packet), b"")
        except PacketError:
            return Asked.OTHER
        kind = kind_of(plain)
        if len(plain) != _SIZES.get(kind):
            return Asked.OTHER
        if kind == KIND_COMMAND:
            found = Asked.COMMAND
    return found


def _without_pulses(data: bytes) -> bytes:
    """Undo :func:`contactfpga.wire.framing.pulses` between two marks."""
    if len(data) % 8 or set(data) - {_ONE, _ZERO}:
        raise PacketError("framing", "pulses that are no bits")
    eights = (data[start : start + 8] for start in range(0, len(data), 8))
    return bytes(sum((pulse == _ONE) << bit for bit, pulse in enumerate(eight)) for eight in eights)
