"""Requests and commands of the host, and the board's answer in a hello (docs/protocol.md)."""

from __future__ import annotations

import bisect
import dataclasses
from collections.abc import Iterable

from contactfpga_sim.model.golden import uart
from contactfpga_sim.model.golden.packet import Packet, check

KIND, COMMAND_KIND = 5, 10
_CHECK_BYTES = 3


@dataclasses.dataclass(frozen=True)
class Request:
    """A request accepted in ``cycle``."""

    cycle: int
    number: int
    hello: bool
    """Whether a hello is requested."""
    command: tuple[int, int] | None = None
    """(what, value) of a command."""


@dataclasses.dataclass(frozen=True)
class Reception:
    """The board's reading of received bytes."""

    requests: list[Request]
    numbers: list[tuple[int, int]]
    """(cycle, number) of every change of the hello's number."""

    def number(self, cycle: int) -> int:
        """The number in a hello whose digit is read in ``cycle``."""
        index = bisect.bisect_right(self.numbers, cycle, key=lambda change: change[0])
        return self.numbers[index - 1][1] if index else 0


def request(number: int, hello: bool = False, bit_clocks: int = 4, closing: bytes = b"", kind: int = KIND) -> bytes:
    """A request as on the wire, with a delimiter at either end, for a board with ``bit_clocks`` per bit. ``closing``:
    of the addressed sheet among several. Another ``kind`` makes an invalid request."""
    return _sent(_digits(number, 3) + bytes([kind << 4 | hello]), bit_clocks, closing)


def command(number: int, what: int, value: int = 0, hello: bool = False, bit_clocks: int = 4) -> bytes:
    """A command as on the wire, with a delimiter at either end."""
    plain = _digits(number, 3) + _digits(what, 1) + _digits(value, 3)
    return _sent(plain + bytes([COMMAND_KIND << 4 | hello]), bit_clocks)


def _digits(value: int, count: int) -> bytes:
    return bytes(128 + value // 128**place % 128 for place in range(count))


def _sent(plain: bytes, bit_clocks: int, closing: bytes = b"") -> bytes:
    packet = Packet()
    packet.push(plain)
    data = b"\0" + packet.wire(after=closing)
    return pulses(data) if uart.pulsed(bit_clocks) else data


def pulses(data: bytes) -> bytes:
    """Bytes as pulses, for short bits: one byte per bit, lowest first, and one per zero byte."""
    mark, one, zero = b"\xf0", b"\xff", b"\x00"
    parts = [[one if bit == "1" else zero for bit in f"{value:08b}"[::-1]] if value else [mark] for value in data]
    return b"".join(b"".join(part) for part in parts)


def requests(cycles: Iterable[int], bit_clocks: int) -> list[tuple[int, bytes]]:
    """A request at each cycle, every other one for a hello, without those that would overlap."""
    sent: list[tuple[int, bytes]] = []
    number = 129 * 128 + 1
    for cycle in cycles:
        if sent and cycle < sent[-1][0] + 10 * bit_clocks * len(sent[-1][1]):
            continue
        sent.append((cycle, request(number, len(sent) % 2 == 0, bit_clocks)))
        number += 2 if number % 8 == 7 else 1
    return sent


def heard(
    received: Iterable[tuple[int, bytes]], bit_clocks: int, commands: bool = False, closing: bytes = b""
) -> Reception:
    """Requests and supported ``commands`` in (cycle, bytes), back to back at the pin from that cycle on; ``closing``:
    of this sheet among several."""
    found = Reception([], [])
    packet: list[int] | None = None  # bytes since the last delimiter
    for byte in uart.received(received, bit_clocks):
        in_number = packet is not None and 1 <= len(packet) <= 3
        if byte.first_bit is not None and in_number and found.numbers and found.numbers[-1][1]:
            found.numbers.append((byte.first_bit + 1, 0))
        if byte.value is None:
            packet = None
        elif byte.value == 0:
            if packet is not None and (one := _read(packet, byte.stop, commands, closing)) is not None:
                found.requests.append(one)
                found.numbers.append((byte.stop + 1, one.number))
            packet = []
        elif packet is not None:
            packet.append(byte.value)
    return found


def _read(packet: list[int], cycle: int, commands: bool, closing: bytes) -> Request | None:
    is_command = commands and packet[:1] != [] and bool(packet[0] & 8)
    stuffed, kind = (9, COMMAND_KIND) if is_command else (5, KIND)
    checked = stuffed + len(closing)
    if len(packet) != checked + _CHECK_BYTES or packet[stuffed - 1] >> 4 != kind:
        return None
    if bytes(packet[stuffed:checked]) != closing:
        return None
    wanted, got = check(bytes(packet[:checked])), packet[checked:]
    if (got[0] ^ wanted[0]) % 128 or (got[1] ^ wanted[1]) % 128 or (got[2] ^ wanted[2]) % 4:
        return None
    what = (packet[4] % 128, _number(packet[5:8])) if is_command else None
    return Request(cycle, _number(packet[1:4]), bool(packet[stuffed - 1] & 1), what)


def _number(digits: list[int]) -> int:
    return sum(digit % 128 * 128**place for place, digit in enumerate(digits))
