"""Sources of bytes with a common interface."""

from __future__ import annotations

import contextlib
import functools
import logging
import os
import random
import shlex
import time
import weakref
from importlib import import_module
from typing import Any, Protocol

from contactfpga.driver import forks
from contactfpga.driver.address import Flexitac, Net, Replay, Serial, SheetOf, Sim, parse
from contactfpga.driver.pace import Pace
from contactfpga.driver.stats import NetCounters
from contactfpga.errors import MissingExtra, PortBusy, PortLost, PortNotFound
from contactfpga.inputs.files import reason_of
from contactfpga.inputs.values import shown
from contactfpga.skin import Skin

SCHEMES = {
    "sim": "contactfpga_sim.model.board.virtual:board_at",
    "replay": "contactfpga.tools.recordings.replay:ReplayTransport",
    "zenoh": "contactfpga.robot.net.port:ZenohPort",
    "flexitac": "contactfpga.driver.flexitac:FlexitacPort",
    "sheet": "contactfpga.driver.sheets:share",
}
"""Opener of each scheme's addresses as "module:attribute", loaded on first use. It makes a :class:`Transport` of an
address, or for ``sim`` a :class:`SimulatedPort`.
"""

OPENED_BY_NAME = {Replay: "replay", Net: "zenoh", Flexitac: "flexitac"}

CHUNK = 65_536

STEP_S, MOMENT_S = 0.5e-3, 2e-3
"""Real seconds between two looks of a paced virtual board at the clock, and most simulated seconds of one read."""
LAG_S = 0.1
"""Largest lag of a paced virtual board that is caught up."""


class Transport(Protocol):
    """Bytes to and from a board."""

    name: str
    live: bool
    """Whether the other end is a board that answers requests."""
    threaded: bool
    """Whether bytes come by themselves, and a separate thread has to read them."""

    def read(self, timeout_s: float) -> bytes:
        """Available bytes, waiting at most ``timeout_s`` for the first one; b"" if none came.

        Raises :class:`PortLost` when nothing can come any more, :class:`ReplayEnded` at the end of a recording.
        """

    def write(self, data: bytes) -> None:
        """Send ``data``; raises :class:`PortLost`."""

    def clock(self) -> float:
        """Seconds on the clock of timeouts; simulated seconds for the simulated board."""

    def close(self) -> None:
        """Close the port; may be called twice."""


class SerialTransport:
    """A serial port, opened exclusively, with low latency, and with DTR and RTS unchanged."""

    live = threaded = True

    def __init__(self, name: str, baud: int):
        from serialx import (
            PinState,
            Serial,
            SerialException,
        )  # 0.1 s that `contactfpga --help` need not wait for

        _quieten("serialx")
        self.name = name
        self._errors: tuple[type[Exception], ...] = (OSError, SerialException)
        alone = PinState.UNDEFINED
        self._buffer = bytearray(CHUNK)
        self._port = Serial(
            path=name,
            baudrate=baud,
            exclusive=True,
            **dict.fromkeys(("dtr_on_open", "rts_on_open", "dtr_on_close", "rts_on_close"), alone),
        )
        try:
            self._port.open()
        except self._errors as error:
            if "locked" in str(error):
                raise PortBusy(f"{name} is in use: {user_of(name)}") from None
            raise PortNotFound(f"{name} cannot be opened: {_reason(error)}; {_next_step(error, name)}") from None
        OPEN_PORTS.add(self)
        forks.watch(self)

    def read(self, timeout_s: float) -> bytes:
        try:
            count = self._port.readinto(self._buffer, timeout=max(0.0, timeout_s))
        except self._errors as error:
            raise self.lost(error) from None
        return bytes(self._buffer[:count])

    def write(self, data: bytes) -> None:
        try:
            self._port.write(data, timeout=1.0)
        except self._errors as error:
            raise self.lost(error) from None

    def clock(self) -> float:
        return time.monotonic()

    def close(self) -> None:
        OPEN_PORTS.discard(self)
        with contextlib.suppress(*self._errors):  # gone already, which is what closing wants
            self._port.close()

    def forked(self) -> None:
        """Close the child's descriptor; the parent keeps the lock."""
        self.close()

    def fileno(self) -> int:
        return int(self._port.fileno())

    def lost(self, error: Exception) -> PortLost:
        return PortLost(f"{self.name} is gone ({_reason(error)}); plug the board in and open it again")


def _quieten(library: str) -> None:
    """Silence a library that logs each read, unless the program sets its level."""
    logger = logging.getLogger(library)
    if logger.level == logging.NOTSET:
        logger.setLevel(logging.WARNING)


class HasName(Protocol):
    name: str


OPEN_PORTS: weakref.WeakSet[HasName] = weakref.WeakSet()


def user_of(name: str) -> str:
    """The user of an open serial port, and the next step."""
    place = os.path.realpath(name)
    if all(os.path.realpath(one.name) != place for one in OPEN_PORTS):
        return "another program reads this port; close it first"
    return "this program opened it already; go on with that board, or close it first, as `with` does"


class SimulatedPort(Protocol):
    """A board in simulated time, such as :class:`contactfpga_sim.model.board.virtual.VirtualBoard`."""

    def read(self, seconds: float) -> bytes:
        """Advance simulated time until bytes come, at most ``seconds``; returns them."""

    def write(self, data: bytes) -> None:
        """Send bytes to the board."""

    def clock(self) -> float:
        """Simulated seconds since power-up."""

    def close(self) -> None:
        """Free the board."""


class SimTransport:
    """A virtual board, simulated during reads."""

    live, threaded = True, False

    def __init__(self, name: str, board: SimulatedPort):
        self.name = name
        self.rng: random.Random | None = getattr(board, "rng", None)
        """The board's random generator of request numbers: equal runs give equal bytes."""
        self.skins: tuple[Skin, ...] = getattr(board, "skins", ())
        """The Skins from which the board was built."""
        self._board = board
        if _SIMULATED.setdefault(id(board), self) is not self:
            raise PortBusy(f"{name} is in use: this program opened it already; close that first")

    def read(self, timeout_s: float) -> bytes:
        # Not less than a clock: time that rounds to none would not pass, and the deadline never come.
        return bytes(self._board.read(max(timeout_s, 1e-6) if timeout_s > 0 else 0.0))

    def write(self, data: bytes) -> None:
        self._board.write(data)

    def clock(self) -> float:
        return float(self._board.clock())

    def close(self) -> None:
        if _SIMULATED.get(id(self._board)) is self:
            del _SIMULATED[id(self._board)]
        self._board.close()


class PacedTransport(SimTransport):
    """A virtual board whose time passes by itself, ``pace`` seconds in one second, or slower on a slow computer; its
    times stay those of the simulation. The board is thread-safe.
    """

    threaded = True

    def __init__(self, name: str, board: SimulatedPort, pace: float):
        super().__init__(name, board)
        self._pace = Pace(self.clock(), pace, most_lag_s=LAG_S)

    def read(self, timeout_s: float) -> bytes:
        """All bytes that are due, of at most :data:`MOMENT_S`, after at most ``timeout_s`` of real or simulated
        time.
        """
        begun, begun_s, data = self.clock(), time.monotonic(), b""
        while True:
            passed = self.clock() - begun
            ends = bool(data) or max(passed, time.monotonic() - begun_s) >= timeout_s
            if (due := self._pace.due(self.clock())) > 0 and not (ends and passed >= MOMENT_S):
                data += super().read(min(due, MOMENT_S))
            elif ends:
                return data
            else:
                time.sleep(STEP_S)


_SIMULATED: weakref.WeakValueDictionary[int, SimTransport] = weakref.WeakValueDictionary()
"""Open transports by board, since two readers would take each other's bytes."""

forks.in_child(_SIMULATED.clear)


def counters_of(transport: Transport) -> NetCounters | None:
    return getattr(transport, "counters", None)


def skins_of(transport: Transport) -> tuple[Skin, ...]:
    """The Skins of a virtual board's sheets."""
    return getattr(transport, "skins", ())


def connect(name: str | SimulatedPort, baud: int, pace: float | None = None) -> Transport:
    """Open the transport for a port name or a virtual board. pace: of a ``sim://`` address that names none."""
    if not isinstance(name, str):
        if not hasattr(name, "read"):
            raise TypeError(f"port is {shown(name)}; it must be a port's name or a virtual board")
        return SimTransport("the virtual board", name)
    address = parse(name)
    if isinstance(address, Serial):
        return SerialTransport(name, baud)
    if isinstance(address, Sim):
        pace = address.pace or pace
        board = virtual_board(name)
        return SimTransport(name, board) if pace is None else PacedTransport(name, board, pace)
    if isinstance(address, SheetOf):
        transport: Transport = _opener("sheet")(address, baud, functools.partial(connect, pace=pace))
    else:
        transport = _opener(OPENED_BY_NAME[type(address)])(name)
    return transport


def virtual_board(name: str, skin: Skin | None = None) -> SimulatedPort:
    """The board of a ``sim://`` address; ``skin``: default. Raises :class:`PortNotFound` without one of its files."""
    opener = _opener("sim")
    try:
        board: SimulatedPort = opener(name, skin)
    except OSError as error:
        raise PortNotFound(f"{name} cannot be opened: {reason_of(error)}; is the path right?") from None
    return board


def _opener(scheme: str) -> Any:
    module, _, attribute = SCHEMES[scheme].partition(":")
    try:
        return getattr(import_module(module), attribute)
    except ModuleNotFoundError as error:
        raise MissingExtra(f"{scheme}:// ({error})", scheme) from None


def _reason(error: Exception) -> str:
    return (error.strerror if isinstance(error, OSError) else None) or str(error) or type(error).__name__


def _next_step(error: Exception, name: str) -> str:
    if isinstance(error, PermissionError):
        return "add yourself to the group that owns it (often `dialout`), or see `contactfpga doctor`"
    if isinstance(error, FileNotFoundError):
        return "is the board plugged in? `contactfpga doctor --list` lists the ports"
    return f"`contactfpga doctor {shlex.quote(name)}` may say why"
