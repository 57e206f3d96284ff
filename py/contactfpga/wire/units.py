"""Packets of pressure units, and the commands for their zeros and thresholds."""

from __future__ import annotations

import dataclasses
import struct

from contactfpga.inputs.values import shown, whole
from contactfpga.skin.units import (
    INDEX_BITS,
    SUM_THRESHOLD,
    THRESHOLD,
    ZERO,
    Units,
    digits_of_reading,
    number_shift,
)
from contactfpga.wire.framing import DIGIT_BITS, FLAG_BITS, PacketError, digits, last_byte, number

KIND_UNITS = 8
TIME_BITS, SEQUENCE_BITS = 24, 8
TRAILER_DIGITS = -(-(TIME_BITS + SEQUENCE_BITS) // DIGIT_BITS)
OVER, ARMED = 1, 2
"""Flags: a threshold is reached; a threshold is set."""

MOST_BITS = 28
MOST_SUM_BITS = MOST_BITS + 7 + 3
"""Most bits of a sum's magnitude: readings times weights of seven bits, over eight units."""

_FACTS = struct.Struct("<BBBBHI")
FACTS_BYTES = _FACTS.size


@dataclasses.dataclass(frozen=True)
class UnitFacts:
    count: int
    bits: int
    sums: int
    sum_bits: int
    """Bits of the largest magnitude of a sum; 0 without sums."""
    spacing_clocks: int
    """Clocks from a unit's sample to the next unit's; 0 for simultaneous samples."""
    sweep_clocks: int
    """Clocks from one sweep to the next."""

    @classmethod
    def of(cls, units: Units) -> UnitFacts:
        skin = units.skin
        sums = len(skin.unit_sums)
        clocks = units.spacing_clocks, units.sweep_clocks
        return cls(skin.units, units.converter.bits, sums, units.sum_bits, *clocks)

    def encode(self) -> bytes:
        return _FACTS.pack(*dataclasses.astuple(self))

    @classmethod
    def decode(cls, value: bytes) -> UnitFacts:
        facts = cls(*_FACTS.unpack_from(value))
        if not (1 <= facts.count <= 1 << INDEX_BITS and 1 <= facts.bits <= MOST_BITS and facts.sweep_clocks):
            raise ValueError(f"{facts.count} units of {facts.bits} bits, {facts.sweep_clocks} clocks a sweep")
        if facts.sum_bits > MOST_SUM_BITS:
            raise ValueError(f"sums of {facts.sum_bits} bits; {MOST_SUM_BITS} is the most")
        return facts


@dataclasses.dataclass(frozen=True)
class Sweep:
    time_us: int
    """Device time of the first unit's sample, modulo 2^24 us."""
    sequence: int
    """Number of sweeps before this one, modulo 256."""
    readings: tuple[int, ...]
    over: bool
    """Whether a threshold is reached."""
    armed: bool


def plain_bytes(units: int, bits: int) -> int:
    return units * digits_of_reading(bits) + TRAILER_DIGITS + 1


def encode_sweep(sweep: Sweep, bits: int) -> bytes:
    data = b"".join(digits(reading, digits_of_reading(bits)) for reading in sweep.readings)
    trailer = digits(sweep.sequence << TIME_BITS | sweep.time_us, TRAILER_DIGITS)
    return data + trailer + bytes([last_byte(KIND_UNITS, OVER * sweep.over | ARMED * sweep.armed)])


def decode_sweep(plain: bytes, facts: UnitFacts) -> Sweep:
    """Read an unsealed packet. Raises :class:`PacketError` if this board cannot have sent it."""
    if len(plain) != plain_bytes(facts.count, facts.bits):
        raise PacketError("length", f"sweep of {len(plain)} bytes; {facts.count} units take another number")
    width, trailer = digits_of_reading(facts.bits), number(plain[-TRAILER_DIGITS - 1 : -1])
    readings = tuple(number(plain[place * width : (place + 1) * width]) for place in range(facts.count))
    written = all(byte & 0x80 for byte in plain[:-1])
    if not written or trailer >> TIME_BITS + SEQUENCE_BITS or any(reading >> facts.bits for reading in readings):
        raise PacketError("content", "a sweep is not written in digits, or filled up with something but zeros")
    flags = plain[-1] & (1 << FLAG_BITS) - 1
    return Sweep(
        trailer & (1 << TIME_BITS) - 1, trailer >> TIME_BITS, readings, bool(flags & OVER), bool(flags & ARMED)
    )


def zero_value(facts: UnitFacts, unit: int, reading: object) -> tuple[int, int]:
    """(what, value) of the command that sets a unit's zero. Raises ValueError."""
    return _value(ZERO, "unit", unit, facts.count, "zero", reading, facts.bits)


def threshold_value(facts: UnitFacts, unit: int, deviation: object) -> tuple[int, int]:
    """(what, value) of the command that sets a unit's threshold; 0: never reached."""
    return _value(THRESHOLD, "unit", unit, facts.count, "threshold", deviation, facts.bits)


def sum_threshold_value(facts: UnitFacts, index: int, deviation: object) -> tuple[int, int]:
    """(what, value) of the command that sets a sum's threshold, rounded down to the board's steps, but not to 0."""
    return _value(SUM_THRESHOLD, "sum", index, facts.sums, "threshold", deviation, facts.sum_bits)


def _value(what: int, kind: str, index: object, count: int, name: str, given: object, bits: int) -> tuple[int, int]:
    place, amount = whole(index), whole(given)
    if place is None or not 0 <= place < count:
        raise ValueError(f"{kind} is {shown(index)}; this board has {count}, counted from 0")
    if amount is None or not 0 <= amount < 1 << bits:
        raise ValueError(
            f"{name} of {kind} {place} is {shown(given)}; it must be a whole number from 0 to {(1 << bits) - 1}"
        )
    shift = number_shift(bits)
    steps = max(amount >> shift, 1) if amount and what != ZERO else amount >> shift
    return what, steps << INDEX_BITS | place
