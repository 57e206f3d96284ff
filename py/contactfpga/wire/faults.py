"""Reports of faulty lines, and slots of the self-test."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable

from contactfpga.wire.framing import DIGIT_BITS, PacketError, digits, last_byte, number

KIND_FAULTS = 9
SLOT = 1
"""Flag of a packet with a slot of the self-test."""
SLOT_DIGITS = 2

STUCK, UNNAMED = "stuck", "unnamed fault"
"""A fault without a name, and one before its name arrives."""
UNPLUGGED = "all lines open"
"""No line answers: the sheet is unplugged, or both guard lines are open at the board."""


@dataclasses.dataclass(frozen=True)
class Faults:
    """Faulty lines, counted from 0, found by a board whose Skin has ``guard`` or ``self_test``.

    >>> contactfpga.Faults(columns_open=(3,)).named(rows=8, columns=8).names
    ('column 3 open',)
    """

    rows_open: tuple[int, ...] = ()
    """Rows that do not reach the guard column."""
    columns_open: tuple[int, ...] = ()
    """Columns that do not reach the guard row."""
    columns_stuck: tuple[int, ...] = ()
    """Columns that read pressed while no row was driven; the guard column's number follows the last column's."""
    joined: bool = False
    """Whether the self-test found joined lines."""
    names: tuple[str, ...] = dataclasses.field(default=(), compare=False)
    """The faults in words, sorted, as in :attr:`Zones.faults`."""

    def __bool__(self) -> bool:
        return bool(self.rows_open or self.columns_open or self.columns_stuck or self.joined)

    def named(self, rows: int, columns: int, mask: Iterable[tuple[int, int]] = ()) -> Faults:
        """The faults with names, for a sheet of this size; masked switches check no line.

        If all checked columns are open, the guard row is named instead, and likewise the guard column; if all lines
        are, :data:`UNPLUGGED` replaces both names.
        """
        masked = set(mask)
        all_rows, all_columns = range(rows), range(columns)
        checked_rows = {row for row in all_rows if any((row, column) not in masked for column in all_columns)}
        checked_columns = {column for column in all_columns if any((row, column) not in masked for row in all_rows)}
        found = _open("row", "guard column open", self.rows_open, checked_rows)
        found += _open("column", "guard row open", self.columns_open, checked_columns)
        if found == ["guard column open", "guard row open"]:
            found = [UNPLUGGED]
        stuck = ("guard column" if column == columns else f"column {column}" for column in self.columns_stuck)
        found += [f"{line} stuck" for line in stuck]
        return dataclasses.replace(self, names=tuple(sorted(found + ["joined lines"] * self.joined)))


def _open(line: str, guard: str, lines: tuple[int, ...], checked: set[int]) -> list[str]:
    if len(checked) > 1 and checked <= set(lines):
        return [guard]
    return [f"{line} {index} open" for index in lines]


@dataclasses.dataclass(frozen=True)
class SelfTestSlot:
    """Lines that read as selected in one slot of the self-test.

    >>> contactfpga.SelfTestSlot(number=1, rows=(0,), columns=()).rows
    (0,)
    """

    number: int
    rows: tuple[int, ...]
    """Rows that read as selected, counted from 0."""
    columns: tuple[int, ...]
    """Columns that read as selected, counted from 0."""


def digits_of(bits: int) -> int:
    return -(-bits // DIGIT_BITS)


def fault_bits(rows: int, columns: int, guard: bool, self_test: bool) -> int:
    """Bits of the fault word: open rows, open columns, stuck columns with the guard column, joined lines; 0 without
    reports."""
    return (rows + 2 * columns + 1 if guard else 0) + self_test


def encode_faults(word: int, bits: int) -> bytes:
    return digits(word, digits_of(bits)) + bytes([last_byte(KIND_FAULTS)])


def encode_slot(slot: int, word: int, bits: int) -> bytes:
    return digits(slot, SLOT_DIGITS) + digits(word, digits_of(bits)) + bytes([last_byte(KIND_FAULTS, SLOT)])


def is_slot(plain: bytes) -> bool:
    """Whether an unsealed packet of this kind is a slot of the self-test."""
    return bool(plain[-1] & SLOT)


def decode_faults(plain: bytes, rows: int, columns: int, guard: bool, self_test: bool) -> Faults:
    """Read an unsealed fault report. Raises :class:`PacketError` if this board cannot have sent it."""
    parts = (rows, columns, columns + 1) if guard else (0, 0, 0)
    rows_open, columns_open, columns_stuck, joined = _lines(plain[:-1], *parts, int(self_test))
    return Faults(rows_open, columns_open, columns_stuck, bool(joined))


def decode_slot(plain: bytes, rows: int, columns: int) -> SelfTestSlot:
    """Read an unsealed slot of the self-test. Raises :class:`PacketError` as :func:`decode_faults`."""
    slot, word = plain[:SLOT_DIGITS], plain[SLOT_DIGITS:-1]
    if len(slot) < SLOT_DIGITS or not all(byte & 0x80 for byte in slot):
        raise PacketError("content", "a slot of the self-test has no number")
    return SelfTestSlot(number(slot), *_lines(word, rows, columns))


def _lines(data: bytes, *widths: int) -> list[tuple[int, ...]]:
    """The set bits of each field of a word in digits, lowest first."""
    if len(data) != digits_of(sum(widths)):
        raise PacketError("length", f"word of {len(data)} digits; lines of this sheet take {digits_of(sum(widths))}")
    word = number(data)
    if not all(byte & 0x80 for byte in data) or word >> sum(widths):
        raise PacketError("content", "a word of lines is not written in digits, or filled up with something but zeros")
    found = []
    for width in widths:
        found.append(tuple(bit for bit in range(width) if word >> bit & 1))
        word >>= width
    return found
