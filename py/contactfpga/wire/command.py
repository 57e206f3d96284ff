"""Commands to a board, and requests in bytes to a board."""

from __future__ import annotations

import dataclasses
import enum

from contactfpga.inputs.values import shown, whole
from contactfpga.skin.derived import SAMPLE_AT, SELF_TEST
from contactfpga.skin.units import SUM_THRESHOLD, THRESHOLD, ZERO
from contactfpga.wire.framing import (
    DELIMITER,
    DIGIT_BITS,
    PacketError,
    digits,
    kind_of,
    last_byte,
    pulses,
    seal,
    unseal,
)
from contactfpga.wire.hello import HEARD_DIGITS
from contactfpga.wire.protocol import KIND_REQUEST, REQUEST_HELLO, may_number

KIND_COMMAND = 10
WHAT_DIGITS, VALUE_DIGITS = 1, 3
MOST_WHAT, MOST_VALUE = (1 << DIGIT_BITS * WHAT_DIGITS) - 1, (1 << DIGIT_BITS * VALUE_DIGITS) - 1

COMMANDS = {
    SELF_TEST: ("self-test", "self_test = true"),
    SAMPLE_AT: ("sample at", 'report = "cells" or ruler'),
    ZERO: ("zero of a pressure unit", "units"),
    THRESHOLD: ("threshold of a pressure unit", "units"),
    SUM_THRESHOLD: ("threshold of a weighted sum", "unit_sums"),
}
"""Name of each command by number, and the Skin's option that it needs."""


@dataclasses.dataclass(frozen=True)
class Command:
    what: int
    """Key of :data:`COMMANDS`."""
    value: int = 0

    def __post_init__(self) -> None:
        for name, most in (("what", MOST_WHAT), ("value", MOST_VALUE)):
            given = getattr(self, name)
            number = whole(given)
            if number is None or not 0 <= number <= most:
                raise ValueError(f"{name} of a command is {shown(given)}; it must be a whole number from 0 to {most:,}")
            object.__setattr__(self, name, number)

    def __str__(self) -> str:
        return COMMANDS[self.what][0] if self.what in COMMANDS else f"command {self.what}"


def encode_command(number: int, command: Command, hello: bool = False, pulsed: bool = False) -> bytes:
    """A command's bytes on the wire; arguments as in :func:`contactfpga.wire.protocol.encode_request`."""
    assert may_number(number), f"{number} is no number of a request"
    words = ((number, HEARD_DIGITS), (command.what, WHAT_DIGITS), (command.value, VALUE_DIGITS))
    plain = b"".join(digits(value, count) for value, count in words)
    data = bytes([DELIMITER]) + seal(plain + bytes([last_byte(KIND_COMMAND, REQUEST_HELLO * hello)]))
    return pulses(data) if pulsed else data


_MARK, _ONE, _ZERO = 0xF0, 0xFF, 0x00
"""Bytes of :func:`contactfpga.wire.framing.pulses`: a mark, and the bits 1 and 0."""
_SIZES = {KIND_REQUEST: HEARD_DIGITS + 1, KIND_COMMAND: HEARD_DIGITS + WHAT_DIGITS + VALUE_DIGITS + 1}


class RequestKind(enum.Enum):
    REQUEST = "requests for a frame or a hello, which change nothing"
    COMMAND = "a command"
    OTHER = "something that no host sends"


def request_kind(data: bytes) -> RequestKind:
    """The strongest request in these bytes, which are whole packets."""
    found = RequestKind.REQUEST if data else RequestKind.OTHER
    while data:
        mark = data[0]
        end = data.find(mark, 1)
        if mark not in (DELIMITER, _MARK) or end < 0:
            return RequestKind.OTHER
        packet, data = data[1:end], data[end + 1 :]
        try:
            plain = unseal(packet if mark == DELIMITER else _without_pulses(packet), b"")
        except PacketError:
            return RequestKind.OTHER
        kind = kind_of(plain)
        if len(plain) != _SIZES.get(kind):
            return RequestKind.OTHER
        if kind == KIND_COMMAND:
            found = RequestKind.COMMAND
    return found


def _without_pulses(data: bytes) -> bytes:
    if len(data) % 8 or set(data) - {_ONE, _ZERO}:
        raise PacketError("framing", "pulses that are no bits")
    eights = (data[start : start + 8] for start in range(0, len(data), 8))
    return bytes(sum((pulse == _ONE) << bit for bit, pulse in enumerate(eight)) for eight in eights)
