"""A map of a packet: a frame's bytes and bits, and a hello's fields."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from contactfpga import picture_style as style
from contactfpga.skin import Skin
from contactfpga.skin.derived import CHECK_BYTES, HEARD_BITS, SEQUENCE_BITS, TIME_BITS, Widths
from contactfpga.wire import hello, protocol
from contactfpga.wire.framing import DIGIT_BITS, FLAG_BITS, KIND_BITS, KIND_HELLO, cobs_decode
from contactfpga_sim.lab.diagrams.canvas import Canvas

LEFT, RIGHT = 16.0, 704.0
HEIGHT = 34.0
BITS = 32


class Field(NamedTuple):
    name: str
    size: int
    color: str


def draw(skin: Skin, path: Path) -> Path:
    """Draw the frames of a Skin that reports moments, and its hello."""
    canvas, widths = Canvas(624), Widths(skin.sheet)
    canvas.text(LEFT, 18, f"Frame with one zone, {skin.rows}x{skin.columns} switches: bytes in the order sent")
    whole = list(_frame(widths))
    _line(canvas, 34, whole, "byte")
    record = list(_record(widths))
    canvas.small(LEFT, 102, "record of a zone, bits, lowest first")
    _line(canvas, 112, record, "bit")
    canvas.small(LEFT, 176, "trailer, bits, lowest first")
    lines = list(_trailer(widths))
    _line(canvas, 186, lines[:2], "bit")
    _line(canvas, 248, lines[2:], "bit")
    canvas.small(LEFT, 324, "check bytes: bits of the CRC-16; the highest bit of each byte is 1")
    _line(canvas, 334, list(_check()), "bit")
    flags = ", ".join(f"{1 << bit} {name}" for bit, name in enumerate(protocol.FLAGS))
    canvas.small(LEFT, 400, f"flags: {flags}. Frames without zones have no record; each further zone adds one.")
    fields = list(_hello(skin))
    total = len(hello.encode_hello(skin))
    canvas.text(LEFT, 440, f"Hello of the same board, {total} bytes: fields in the order sent")
    half = -(-len(fields) // 2)
    _line(canvas, 456, fields[:half], "byte", even=True)
    _line(canvas, 520, fields[half:], "byte", even=True)
    canvas.small(
        LEFT, 588, "Each field has its type and its length in a byte each, then the bytes that are counted here."
    )
    canvas.small(
        LEFT,
        606,
        f"As in a frame, a COBS byte comes first, and kind {KIND_HELLO}, check bytes and the zero byte come last.",
    )
    return canvas.save(path)


def _frame(widths: Widths) -> Iterator[Field]:
    yield Field("COBS", 1, style.GRAY)
    yield Field("record", widths.record_bytes, style.BLUE)
    yield Field("trailer", widths.trailer_bytes, style.GREEN)
    yield Field("check", CHECK_BYTES, style.ORANGE)
    yield Field("zero", 1, style.GRAY)


def _record(widths: Widths) -> Iterator[Field]:
    names = ("area", "sum_x", "sum_y")
    yield from (Field(name, bits, style.BLUE) for name, bits in zip(names, widths.record_bits, strict=True))
    spare = 8 * widths.record_bytes - sum(widths.record_bits)
    if spare:
        yield Field("0", spare, style.GRAY)


def _trailer(widths: Widths) -> Iterator[Field]:
    for name, bits in (
        ("time, µs", TIME_BITS),
        ("sequence", SEQUENCE_BITS),
        ("heard", HEARD_BITS),
        ("cells", widths.area_bits),
        ("zones", widths.zones_bits),
        ("overwritten", widths.overwritten_bits),
        ("flags", FLAG_BITS),
        ("kind", KIND_BITS),
    ):
        yield Field(name, bits, style.GREEN)


def _check() -> Iterator[Field]:
    for first in range(0, 16, DIGIT_BITS):
        last = min(first + DIGIT_BITS, 16)
        yield Field(f"{first}-{last - 1}", last - first, style.ORANGE)
        if last - first < DIGIT_BITS:
            yield Field("0", DIGIT_BITS - (last - first), style.GRAY)
        yield Field("1", 1, style.GRAY)


_TYPES = ("SHEET", "STATE", "PITCH", "RADIUS", "FINGERPRINT", "RATES", "NAME", "COMMANDS", "UNITS", "PLACE", "CHECK")
NAMES = {getattr(hello, name): name.lower() for name in _TYPES}


def _hello(skin: Skin) -> Iterator[Field]:
    packet = hello.encode_hello(skin).strip(b"\0")
    data = cobs_decode(packet[:-CHECK_BYTES])[:-1]
    while data:
        kind, size = data[0], data[1]
        yield Field(f"{kind} {NAMES[kind]}", size, style.PURPLE)
        data = data[2 + size :]


def _line(canvas: Canvas, y: float, fields: Sequence[Field], unit: str, even: bool = False) -> None:
    total = len(fields) if even else max(sum(one.size for one in fields), BITS if unit == "bit" else 0)
    step = (RIGHT - LEFT) / total
    sizes = [1 if even else one.size for one in fields]
    edges = [LEFT + step * size for size in itertools.accumulate(sizes, initial=0)]
    for one, (left, right) in zip(fields, itertools.pairwise(edges), strict=True):
        canvas.box(left, y, right - left, HEIGHT, one.color)
        if not even and unit == "byte":
            for byte in range(1, one.size):
                canvas.line((left + byte * step, y), (left + byte * step, y + 5), color=one.color)
        canvas.text((left + right) / 2, y + HEIGHT / 2, one.name, ha="center", fontsize=style.SMALL)
        plural = "" if one.size == 1 or not even else "s"
        count = f"{one.size} {unit}{plural}" if even else str(one.size)
        canvas.small((left + right) / 2, y + HEIGHT + 10, count, ha="center")
