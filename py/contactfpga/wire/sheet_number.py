"""Packets of several sheets that share one FPGA and its line.

A numbered packet is an ordinary one with two bytes after its stuffed bytes, which the check covers too. Removing them
and running the CRC backward keeps the check right or wrong, so packets can be sorted without the check's prefix.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

from contactfpga.skin.derived import CHECK_BYTES
from contactfpga.wire import framing
from contactfpga.wire.framing import DELIMITER, DIGIT_BITS, FLAG_BITS

KIND_NUMBERED = 11
NUMBER_BYTES = 2
_BLOCK = 2
"""COBS code of a zero after the packet and of a block of one byte."""
_MARKS = (0x80, 0x80, 0xFC)
"""Bits of the check bytes that are not part of the CRC."""
_BITS = (DIGIT_BITS, DIGIT_BITS, 16 - 2 * DIGIT_BITS)
_POLYNOMIAL = 0x8408


class SheetPlace(NamedTuple):
    """Position of a sheet among those of its FPGA."""

    number: int
    sheets: int


def closing(number: int) -> bytes:
    return bytes([_BLOCK, framing.last_byte(KIND_NUMBERED, number)])


def sheet_of(packet: bytes) -> int | None:
    """The number in a packet without delimiters, whose check is not verified; None without a number."""
    if len(packet) < framing.SHORTEST_PACKET + NUMBER_BYTES:
        return None
    block, last = packet[-CHECK_BYTES - NUMBER_BYTES : -CHECK_BYTES]
    return last & (1 << FLAG_BITS) - 1 if block == _BLOCK and last >> FLAG_BITS == KIND_NUMBERED else None


def unnumbered(packet: bytes) -> bytes:
    """The ordinary packet from a numbered one, both without delimiters."""
    numbered, check = packet[:-CHECK_BYTES], packet[-CHECK_BYTES:]
    stuffed, closed = numbered[:-NUMBER_BYTES], numbered[-NUMBER_BYTES:]
    return stuffed + _moved(check, closed[::-1], _back)


def numbered(packet: bytes, number: int) -> bytes:
    """The numbered packet from an ordinary one, both without delimiters."""
    stuffed, check = packet[:-CHECK_BYTES], packet[-CHECK_BYTES:]
    return stuffed + closing(number) + _moved(check, closing(number), _on)


def numbered_requests(data: bytes, number: int) -> bytes:
    """Whole requests and commands, with delimiters, with a sheet's number, as bytes or as pulses."""
    return b"".join(_numbered_request(packet, pulsed, number) for packet, pulsed in _requests(data))


def _numbered_request(packet: bytes, pulsed: bool, number: int) -> bytes:
    delimiter = bytes([DELIMITER])
    whole = delimiter + numbered(packet, number) + delimiter
    return framing.pulses(whole) if pulsed else whole


def _requests(data: bytes) -> Iterator[tuple[bytes, bool]]:
    while data:
        pulsed = data[0] != DELIMITER
        end = data.index(data[0], 1)
        yield _of_pulses(data[1:end]) if pulsed else data[1:end], pulsed
        data = data[end + 1 :]


def _of_pulses(bits: bytes) -> bytes:
    levels = [bit & 1 for bit in bits]
    return bytes(sum(levels[at + place] << place for place in range(8)) for at in range(0, len(levels), 8))


def _moved(check: bytes, data: bytes, step: Callable[[int, int], int]) -> bytes:
    crc = offset = 0
    for byte, bits in zip(check, _BITS, strict=True):
        crc |= (byte & (1 << bits) - 1) << offset
        offset += bits
    for byte in data:
        crc = step(crc, byte)
    moved = bytearray()
    for byte, marks, bits in zip(check, _MARKS, _BITS, strict=True):
        moved.append(byte & marks | crc & (1 << bits) - 1)
        crc >>= bits
    return bytes(moved)


def _on(crc: int, byte: int) -> int:
    crc ^= byte
    for _ in range(8):
        crc = crc >> 1 ^ _POLYNOMIAL * (crc & 1)
    return crc


def _back(crc: int, byte: int) -> int:
    for _ in range(8):
        fed = crc >> 15
        crc = (crc ^ _POLYNOMIAL * fed) << 1 | fed
    return crc ^ byte
