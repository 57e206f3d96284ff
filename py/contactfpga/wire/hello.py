"""Hellos: fields by type and length, so that later boards can add fields."""

from __future__ import annotations

import dataclasses
import struct
import zlib

from contactfpga.choices.reports import REPORTS
from contactfpga.skin import Skin
from contactfpga.skin.derived import CHECK_BYTES, SELF_TEST, pulsed
from contactfpga.skin.sheet import Sheet
from contactfpga.wire import framing
from contactfpga.wire.framing import DELIMITER, KIND_HELLO, PacketError, digits, last_byte, number, seal
from contactfpga.wire.sheet_number import SheetPlace
from contactfpga.wire.units import FACTS_BYTES, UnitFacts

SHEET, STATE, PITCH, RADIUS, FINGERPRINT, RATES, NAME, COMMANDS, UNITS, PLACE, CHECK = *range(1, 11), 255

_SHEET = struct.Struct("<BBBBBBHBB")
_PITCH = struct.Struct("<dd")
_RADIUS = struct.Struct("<d")
_RATES = struct.Struct("<II")
_CHECK = struct.Struct("<I")
_REPORTS = tuple(report.name for report in sorted(REPORTS.values(), key=lambda report: report.code))
_SENDS = ("always", "on_change")
_FINGERPRINT_BYTES = 8
_CLOSED, _EXTENT, _LEVELS = 0x80, 0x40, 0x10
"""Flags of a sheet whose ends meet, and of zones with extents, and the unit of its levels above one, 0 to 3; a reader
that does not know one refuses the connectivity."""

SENT_DIGITS, EPOCH_DIGITS, HEARD_DIGITS, STUCK_DIGITS = 7, 4, 3, 1
STATE_DIGITS = 16
"""Digits of the state; the last is unused."""

STATE_OFFSET = 16
"""Offset of the state's first digit in a hello of :func:`encode_hello`, with its leading delimiter."""

_SIZES = {
    SHEET: _SHEET.size,
    STATE: STATE_DIGITS,
    PITCH: _PITCH.size,
    RADIUS: _RADIUS.size,
    FINGERPRINT: _FINGERPRINT_BYTES,
    RATES: _RATES.size,
    UNITS: FACTS_BYTES,
    PLACE: len(SheetPlace._fields),
    CHECK: _CHECK.size,
}
"""Least bytes of a field by type."""
_MANDATORY = {SHEET, STATE, PITCH, FINGERPRINT, RATES}
_MOST_BYTES = 8192


@dataclasses.dataclass(frozen=True, kw_only=True)
class Hello:
    """A board's description of itself.

    >>> with contactfpga.open("sim://") as board:
    ...     board.hello.baud
    3000000
    """

    sheet: Sheet
    fingerprint: bytes
    """The Skin's eight bytes."""
    name: str
    """Name of the Skin."""
    clock_hz: int
    baud: int
    send: str
    guard: bool
    """Whether the board has guard lines and so names faulty lines."""
    commands: bytes
    """Numbers of the board's commands; see :meth:`Board.command`."""
    units: UnitFacts | None = None
    """Pressure units; None without any."""
    place: SheetPlace | None = None
    """The sheet's number among several on one FPGA, and their count; None for a board with one sheet."""
    sent: int
    """Frames sent since power-up."""
    epoch: int
    """Whole periods of 2^22 us since power-up."""
    heard: int
    """Number of the last request received."""
    stuck: int
    """Columns that read pressed while no row was driven, as of the last packed frame; 7 means 7 or more."""

    @property
    def self_test(self) -> bool:
        """Whether the board can test its lines."""
        return SELF_TEST in self.commands

    @property
    def pulsed(self) -> bool:
        """Whether requests must be pulses: the board has fewer than 4 clocks per bit."""
        return pulsed(self.clock_hz, self.baud)


def encode_hello(
    skin: Skin, sent: int = 0, epoch: int = 0, heard: int = 0, stuck: int = 0, place: SheetPlace | None = None
) -> bytes:
    """The hello of a board of ``skin`` on the wire, with a delimiter at either end.

    ``place``: the sheet's number among several; the packet itself is not numbered here.
    """
    sheet = _SHEET.pack(
        skin.rows,
        skin.columns,
        skin.connectivity | _CLOSED * skin.closed | _EXTENT * skin.extent | _LEVELS * (skin.levels - 1),
        _REPORTS.index(skin.report),
        skin.sheet.barycenter_bits,
        _SENDS.index(skin.send),
        skin.sheet.zone_capacity,
        skin.ghosts,
        skin.guard,
    )
    facts = [(SHEET, sheet), (PITCH, _PITCH.pack(skin.pitch_x_mm, skin.pitch_y_mm))]
    if skin.radius_mm is not None:
        facts.append((RADIUS, _RADIUS.pack(skin.radius_mm)))
    facts += [(FINGERPRINT, skin.fingerprint), (RATES, _RATES.pack(skin.clock_hz, skin.baud))]
    if skin.name:
        facts.append((NAME, skin.name.encode()))
    if commands := skin.derived.commands:
        facts.append((COMMANDS, bytes(commands)))
    if skin.units:
        facts.append((UNITS, UnitFacts.of(skin.derived.units).encode()))
    if place is not None:
        facts.append((PLACE, bytes(place)))
    fixed = [bytes([kind, len(value)]) + value for kind, value in facts]
    counters = ((sent, SENT_DIGITS), (epoch, EPOCH_DIGITS), (heard, HEARD_DIGITS), (stuck, STUCK_DIGITS), (0, 1))
    state = bytes([STATE, STATE_DIGITS]) + b"".join(digits(value, count) for value, count in counters)
    check = bytes([CHECK, _CHECK.size]) + _CHECK.pack(zlib.crc32(b"".join(fixed)))
    plain = fixed[0] + state + b"".join(fixed[1:]) + check + bytes([last_byte(KIND_HELLO)])
    return bytes([DELIMITER]) + seal(plain)


class HelloReader:
    """Joins hellos from packets."""

    def __init__(self) -> None:
        self._fields: dict[int, bytes] = {}
        self._checked = bytearray()

    def take(self, plain: bytes) -> Hello | None:
        """Add an unsealed hello packet; returns the hello that it completes, or None. Raises :class:`PacketError`."""
        try:
            return self._take(plain[:-1])
        except PacketError:
            self._fields.clear()
            raise

    def _take(self, data: bytes) -> Hello | None:
        while data:
            kind, value = data[0], data[2 : 2 + data[1]] if len(data) > 1 else b""
            if len(data) < 2 or len(value) != data[1]:
                raise PacketError("length", f"field {kind} of a hello is cut off")
            field, data = data[: 2 + len(value)], data[2 + len(value) :]
            if kind == SHEET:
                self._fields.clear()
                self._checked.clear()
            elif not self._fields:
                raise PacketError("content", f"hello without its beginning: field {kind} comes first")
            if len(value) < _SIZES.get(kind, 0):
                raise PacketError("content", f"field {kind} of a hello has {len(value)} bytes")
            if kind == CHECK:
                if data:
                    raise PacketError("length", f"hello with {len(data)} bytes after its end")
                return self._finish(value)
            if kind != STATE:
                self._checked += field
            if len(self._checked) > _MOST_BYTES:
                raise PacketError("length", f"hello of over {_MOST_BYTES} bytes")
            self._fields[kind] = value
        return None

    def _finish(self, check: bytes) -> Hello:
        if _CHECK.unpack_from(check)[0] != zlib.crc32(self._checked):
            raise PacketError("crc", "CRC-32 of a hello does not match")
        fields, self._fields = self._fields, {}
        if missing := _MANDATORY - set(fields):
            raise PacketError("content", f"hello without field {min(missing)}")
        try:
            return _hello(fields)
        except ValueError as error:
            raise PacketError("content", f"hello of a sheet that cannot be: {error}") from None


def _hello(fields: dict[int, bytes]) -> Hello:
    rows, columns, connectivity, report, bits, send, capacity, ghosts, faults = _SHEET.unpack_from(fields[SHEET])
    pitch_x_mm, pitch_y_mm = _PITCH.unpack_from(fields[PITCH])
    if report >= len(_REPORTS) or send >= len(_SENDS) or ghosts > 1:
        raise ValueError(f"report is {report}, send is {send}, diodes is {ghosts}")
    sheet = Sheet(
        rows=rows,
        columns=columns,
        connectivity=connectivity % _LEVELS,
        closed=bool(connectivity & _CLOSED),
        extent=bool(connectivity & _EXTENT),
        levels=1 + connectivity // _LEVELS % 4,
        report=_REPORTS[report],
        barycenter_bits=bits,
        zone_capacity=capacity,
        pitch_x_mm=pitch_x_mm,
        pitch_y_mm=pitch_y_mm,
        radius_mm=_RADIUS.unpack_from(fields[RADIUS])[0] if RADIUS in fields else None,
        ghosts=bool(ghosts),
    )
    sheet.check()
    clock_hz, baud = _RATES.unpack_from(fields[RATES])
    if not (clock_hz and baud):
        raise ValueError(f"clock is {clock_hz} Hz, baud rate is {baud}")
    state = fields[STATE]
    if not all(digit & 0x80 for digit in state[:STATE_DIGITS]):
        raise ValueError("its state is not written in digits")
    return Hello(
        sheet=sheet,
        fingerprint=fields[FINGERPRINT][:_FINGERPRINT_BYTES],
        name=fields.get(NAME, b"").decode(),
        clock_hz=clock_hz,
        baud=baud,
        send=_SENDS[send],
        guard=bool(faults & 1),
        commands=fields.get(COMMANDS, b""),
        units=UnitFacts.decode(fields[UNITS]) if UNITS in fields else None,
        place=_place(fields[PLACE]) if PLACE in fields else None,
        **_counters(state),
    )


def _place(data: bytes) -> SheetPlace:
    place = SheetPlace(*data[: len(SheetPlace._fields)])
    if place.number >= place.sheets:
        raise ValueError(f"it is of sheet {place.number} of {place.sheets}")
    return place


def _counters(state: bytes) -> dict[str, int]:
    counters, offset = {}, 0
    for name, count in {
        "sent": SENT_DIGITS,
        "epoch": EPOCH_DIGITS,
        "heard": HEARD_DIGITS,
        "stuck": STUCK_DIGITS,
    }.items():
        counters[name] = number(state[offset : offset + count])
        offset += count
    return counters


def begins_hello(packet: bytes) -> bool:
    """Whether a packet, without delimiters, is a hello or the first part of one."""
    if len(packet) < framing.SHORTEST_PACKET:
        return False
    if packet[-CHECK_BYTES - 1] >> framing.FLAG_BITS != framing.KIND_HELLO:  # quicker than the check
        return False
    try:
        return framing.unseal(packet, b"")[0] == SHEET
    except PacketError:
        return False


def find_hello(data: bytes, last: bool = False) -> int:
    """Start of the first, or the ``last``, whole hello in ``data``; -1: none."""
    found, start = -1, 0
    while (end := data.find(0, start)) >= 0:
        if begins_hello(data[start:end]):
            if not last:
                return start
            found = start
        start = end + 1
    return found


class Cutter:
    """Cuts a stream of bytes at the next hello."""

    def __init__(self) -> None:
        self.held = b""
        """The beginning of an incomplete packet."""

    def take(self, data: bytes) -> tuple[bytes, bytes]:
        """Bytes before and after the cut; without a hello, no bytes after."""
        data = self.held + data
        at = find_hello(data)
        if at >= 0:
            self.held = b""
            at -= data[max(0, at - 2) : at].count(0) == min(at, 2) > 0  # a hello has a delimiter at either end
            return data[:at], data[at:]
        end = data.rfind(0) + 1
        self.held = data[end:]
        return data[:end], b""


def report_of(sheet: Sheet) -> str:
    precise = f" of {sheet.barycenter_bits} fraction bits" if sheet.report == "barycenter" else ""
    return f"report {sheet.report!r}{precise}"


def describe(hello: Hello) -> str:
    sheet = hello.sheet
    name = f" named {hello.name!r}" if hello.name else ""
    return (
        f"a {sheet.rows}x{sheet.columns} Skin{name} (fingerprint {hello.fingerprint.hex()}, {report_of(sheet)}, "
        f"connectivity {sheet.connectivity})"
    )


def difference(hello: Hello, expected: Skin) -> str:
    """A board's Skin, and its difference from the expected one, in words."""
    sent, asked = _facts(hello), _expected_facts(expected)
    differing = [f"{name} is {sent[name]}, asked for was {asked[name]}" for name in sent if sent[name] != asked[name]]
    if differing:
        what = "; ".join(differing)
    else:
        changed = ", ".join(f"{name} = {value!r}" for name, value in expected.changed.items()) or "only default values"
        what = f"the two differ in fields that a hello does not tell; the Skin asked for has {changed}"
    prints = f"fingerprint {hello.fingerprint.hex()}, asked for was {expected.fingerprint.hex()}"
    return f"another Skin: {what} ({prints}); give its own Skin or none, or load the bitstream of this one"


def _facts(hello: Hello) -> dict[str, object]:
    return dataclasses.asdict(hello.sheet) | {"send": hello.send, "clock_hz": hello.clock_hz, "baud": hello.baud}


def _expected_facts(skin: Skin) -> dict[str, object]:
    return dataclasses.asdict(skin.sheet) | {"send": skin.send, "clock_hz": skin.clock_hz, "baud": skin.baud}
