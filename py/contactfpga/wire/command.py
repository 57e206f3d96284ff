"""Commands to a board (docs/protocol.md)."""

from __future__ import annotations

import dataclasses

from contactfpga.inputs.values import shown, whole
from contactfpga.skin.derived import SAMPLE_AT, SELF_TEST
from contactfpga.skin.units import SUM_THRESHOLD, THRESHOLD, ZERO
from contactfpga.wire.framing import DELIMITER, DIGIT_BITS, digits, last_byte, pulses, seal
from contactfpga.wire.hello import HEARD_DIGITS
from contactfpga.wire.protocol import REQUEST_HELLO, may_number

KIND_COMMAND = 10
"""To the board."""
WHAT_DIGITS, VALUE_DIGITS = 1, 3
MOST_WHAT, MOST_VALUE = (1 << DIGIT_BITS * WHAT_DIGITS) - 1, (1 << DIGIT_BITS * VALUE_DIGITS) - 1

COMMANDS = {
    SELF_TEST: ("self-test", "self_test = true"),
    SAMPLE_AT: ("sample at", 'report = "cells" and scan = "raster" or "reversal"'),
    ZERO: ("zero of a pressure unit", "units"),
    THRESHOLD: ("threshold of a pressure unit", "units"),
    SUM_THRESHOLD: ("threshold of a weighted sum", "unit_sums"),
}
"""Name of each command, and what has to be in the Skin of a board that takes it."""


@dataclasses.dataclass(frozen=True)
class Command:
    """Something that a board shall do."""

    what: int
    """Its number, a key of :data:`COMMANDS`."""
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
    """A command with the number of a request, as on the wire; as
    :func:`contactfpga.wire.protocol.encode_request`."""
    assert may_number(number), f"{number} is no number of a request"
    words = ((number, HEARD_DIGITS), (command.what, WHAT_DIGITS), (command.value, VALUE_DIGITS))
    plain = b"".join(digits(value, count) for value, count in words)
    data = bytes([DELIMITER]) + seal(plain + bytes([last_byte(KIND_COMMAND, REQUEST_HELLO * hello)]))
    return pulses(data) if pulsed else data
