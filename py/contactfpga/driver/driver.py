"""The driver: `read_zones` for one frame now, `open` for every frame."""

from __future__ import annotations

import atexit
import contextlib
import os
import threading
from pathlib import Path

from contactfpga.choices.choice import trusted
from contactfpga.driver import forks, native, recording
from contactfpga.driver.address import searched
from contactfpga.driver.board import Board, Opening
from contactfpga.driver.link import DROPPED, Link
from contactfpga.driver.native_link import NativeLink, NativePort
from contactfpga.driver.recording import FileTap, RecordingTransport, Tap
from contactfpga.driver.subscription import checked
from contactfpga.driver.transport import SerialTransport, SimulatedPort, Transport, connect
from contactfpga.errors import AddressError, BoardClosed, PortBusy, PortLost, SkinMismatch
from contactfpga.inputs.values import shown
from contactfpga.skin import Skin
from contactfpga.zones.zone import Zones

DEFAULT_BAUD = Skin().baud
READERS = ("native", "thread")


def open(
    port: str | os.PathLike[str] | SimulatedPort | None = None,
    skin: Skin | str | Path | None = None,
    *,
    baud: int | None = None,
    record: str | Path | Tap | None = None,
    timeout: float = 1.0,
    trust: bool = False,
    reader: str | None = None,
) -> Board:
    """Open a board and wait for its hello.

    >>> with contactfpga.open("sim://?scene=two_fingers") as board:
    ...     zones = board.next()
    >>> len(zones)
    2

    ``port``: a device path, ``name:LEFT`` for the board with that name, ``usb:SERIAL`` for the one with that USB serial
    number, ``sim://`` (``?scene=NAME&skin=FILE``; ``pace=1``: in real time, otherwise only during reads),
    ``replay://FILE`` (``?pace=1``: in its own time, otherwise as fast as it is read), ``flexitac://DEVICE`` for a
    foreign sheet, a virtual board (:class:`~contactfpga_sim.model.board.virtual.VirtualBoard`, which is closed with the
    board), or None for the one supported board that is plugged in; with ``skin``, for the one with that Skin, or among
    several for the one with its name.

    ``skin``: the Skin (or its file) from which the board must be built; None accepts any board. ``baud``: bits per
    second; by default the baud rate of ``skin``, or 3,000,000. ``record``: a file for every received byte, to be read
    by ``replay://``, or a :class:`~contactfpga.driver.recording.Tap`. ``timeout`` in seconds, for the hello. ``trust``:
    allow Skin files to name modules, which are imported and so run (:meth:`Skin.load`). ``reader``: ``"native"`` reads
    a serial port in a thread in C, which never waits for Python; ``"thread"`` reads any port in a thread in Python; the
    default is the first that can, and ``"thread"`` for a Tap, which gets bytes as they come (docs/use.md).

    Raises :class:`AddressError`, :class:`PortNotFound`, :class:`PortBusy`, :class:`PortLost`, :class:`BoardSilent`,
    :class:`OnlyNoise`, :class:`ReadTimeout`, :class:`SkinMismatch`, :class:`VersionMismatch`; :class:`SkinError` for a
    Skin that cannot work, and OSError for an unreadable file.
    """
    timeout = checked(timeout)
    if reader is not None and reader not in READERS:
        raise ValueError(f"reader is {shown(reader)}; it must be one of {', '.join(READERS)}")
    if skin is not None and not isinstance(skin, Skin):
        skin = Skin.load(skin, trust)
    if baud is None:
        baud = skin.baud if skin is not None else DEFAULT_BAUD
    low, high, _ = Skin.limits("baud")
    if not isinstance(baud, int) or not low <= baud <= high:
        raise ValueError(f"baud is {shown(baud)}; it must be a whole number from {low} to {high}")
    if isinstance(record, str | Path):
        recording.check(record)
    elif record is not None and not hasattr(record, "take"):
        raise TypeError(f"record is {shown(record)}; it must be the name of a file or a Tap")
    if isinstance(port, os.PathLike):
        port = os.fspath(port)
    with trusted(trust):
        try:
            board = _opened(port, skin, baud, record, reader)
        except PortBusy:
            if not _given_back():
                raise
            board = _opened(port, skin, baud, record, reader)
    try:
        board.greet(timeout)
    except BaseException as error:
        board.close()
        if isinstance(error, SkinMismatch) and board.port.startswith("sim:"):
            step = "a virtual board is built from the Skin that its address names: sim://?skin=FILE"
            raise SkinMismatch(f"{error}; {step}") from None
        raise
    return board


def _opened(
    port: str | SimulatedPort | None, skin: Skin | None, baud: int, record: str | Path | Tap | None, reader: str | None
) -> Board:
    if port is None or (isinstance(port, str) and searched(port)):
        from contactfpga.driver import finding  # all boards, which a named port has no use for

        port = finding.find(port, skin, baud)
    why_not = native.refusal(port)
    if reader == "native" and why_not:
        name = port if isinstance(port, str) else "a virtual board"
        raise AddressError(f"{name}: reader='native' cannot read it: {why_not}; leave reader out")
    transport: Transport = connect(port, baud)
    try:
        line = None
        wanted = reader == "native" or (reader is None and isinstance(record, str | Path | None))
        if wanted and not why_not and isinstance(transport, SerialTransport):
            transport = line = NativePort(transport)
        if record is not None:
            tap = FileTap(record) if isinstance(record, (str, Path)) else record
            transport = RecordingTransport(transport, tap)
        link = Link(transport, skin) if line is None else NativeLink(line, transport, skin)
        return Board(link, skin, record.opened if isinstance(record, Opening) else None)
    except BaseException:
        transport.close()
        raise


_boards: dict[str | None, Board] = {}
_lock = threading.RLock()


def read_zones(port: str | None = None, timeout: float = 1.0) -> Zones:
    """Read the contact zones of a board: the first complete frame scanned after this call.

    >>> zones = contactfpga.read_zones("sim://?scene=two_fingers")
    >>> zones[0].area_mm2
    400.0

    ``port`` and errors as for :func:`open`. The port stays open until :func:`open` asks for it. ``timeout`` in seconds,
    after which it raises :class:`ReadTimeout`, a :class:`TimeoutError`.
    """
    timeout = checked(timeout)
    with _lock:
        board = _boards.get(port)
    if board is not None:
        try:
            return board.read(timeout)
        except (PortLost, BoardClosed):
            _forget(port, board)  # perhaps it was plugged in again since the last call: try once more below
    fresh = False
    with _lock:
        if (board := _boards.get(port)) is None:
            board = _boards[port] = open(port, timeout=timeout)
            fresh = True  # the answer to the hello was scanned after this call as well
    try:
        return board.next(timeout) if fresh else board.read(timeout)
    except PortLost:
        _forget(port, board)
        raise


def _forget(port: str | None, board: Board | None = None) -> None:
    with _lock:
        if board is None or _boards.get(port) is board:
            board = _boards.pop(port, None)
    if board is not None:
        board.close()


def _given_back() -> bool:
    """Close the boards that nothing else uses, and the links of dropped boards. Return whether there was one."""
    kept = list(_boards.items())
    for port, board in kept:
        _forget(port, board)
    with _lock:
        dropped = [DROPPED.popleft() for _ in range(len(DROPPED))]
    for one in dropped:
        if (link := one()) is not None:  # else its reader has closed the port since it was found busy
            link.close()
    return bool(kept or dropped)


@forks.in_child
def _begin_anew() -> None:
    global _lock
    _lock = threading.RLock()
    _boards.clear()


@atexit.register
def _close_all() -> None:
    for port in list(_boards):
        with contextlib.suppress(Exception):
            _forget(port)
