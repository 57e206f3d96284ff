"""A port of an FPGA with several sheets, whose packets have the sheet's number (docs/protocol.md).

``PORT#1`` is sheet 1 at a port, and behaves like a board of its own. The real port is open while one of its sheets is.
"""

from __future__ import annotations

import contextlib
import threading
from collections import deque
from collections.abc import Callable

from contactfpga.driver import forks
from contactfpga.driver.address import SheetOf
from contactfpga.driver.conversation import Conversation
from contactfpga.driver.transport import Transport, connect, skins_of
from contactfpga.errors import ContactFPGAError, PortNotFound
from contactfpga.skin.derived import LONGEST_PACKET
from contactfpga.wire import framing
from contactfpga.wire.framing import PacketError
from contactfpga.wire.hello import Hello, HelloReader, begins_hello
from contactfpga.wire.sheet_number import NUMBER_BYTES, numbered_requests, sheet_of, unnumbered

READ_S = 0.05

MOST_WAIT = 16_384
"""Most packets that wait for a sheet; beyond that, the oldest are dropped."""

_DAMAGED = b"\x01\x00"
"""A packet of an unknown sheet, which every sheet counts as damaged."""


class Sorter:
    def __init__(self) -> None:
        self.alone = False
        """Whether the last hello is of a board with one sheet, without number."""
        self.sheets: int | None = None
        self._rest = b""

    def take(self, data: bytes) -> list[tuple[int | None, bytes]]:
        """(sheet, packet with its delimiter) of all packets that ``data`` completes; packets without a sheet are
        invalid for every sheet.
        """
        *packets, self._rest = (self._rest + data).split(b"\0")
        found = [self._sorted(packet) for packet in packets if packet]
        if len(self._rest) > LONGEST_PACKET + NUMBER_BYTES:
            found.append((None, _DAMAGED))
            self._rest = b""
        return found

    def _sorted(self, packet: bytes) -> tuple[int | None, bytes]:
        sheet = sheet_of(packet)
        if sheet is None:
            self.alone = self.alone or begins_hello(packet)
            return None, _DAMAGED
        packet = unnumbered(packet)
        if begins_hello(packet):
            self.alone = False
            with contextlib.suppress(PacketError):  # who reads the sheet counts it
                hello = HelloReader().take(framing.unseal(packet, b""))
                self.sheets = hello.place.sheets if hello is not None and hello.place is not None else self.sheets
        return sheet, packet + b"\0"


class SharedPort:
    """A port whose sheets are opened one by one. Thread-safe."""

    def __init__(self, inner: Transport, baud: int):
        self.inner = inner
        self.baud = baud
        self.failure: Exception | None = None
        self._changed = threading.Condition()
        self._writing = threading.Lock()
        self._reading = False
        self._sorter = Sorter()
        self._waiting: dict[SheetPort, deque[bytes]] = {}

    @property
    def names(self) -> list[str]:
        return [f"{self.inner.name}#{number}" for number in range(self._sorter.sheets or 0)]

    def add(self, sheet: SheetPort) -> None:
        """Keep packets of this sheet from now on. The bitstream may have changed."""
        with self._changed:
            self._sorter.alone = False
            self._waiting[sheet] = deque(maxlen=MOST_WAIT)

    def drop(self, sheet: SheetPort) -> bool:
        with self._changed:
            return self._waiting.pop(sheet, None) is not None and not self._waiting

    def read(self, sheet: SheetPort, timeout_s: float) -> bytes:
        """Received bytes of this sheet; one of the waiting sheets reads for all."""
        until = self.inner.clock() + timeout_s
        with self._changed:
            while True:
                if data := b"".join(self._waiting[sheet]):
                    self._waiting[sheet].clear()
                    return data
                self._check(sheet)
                left = until - self.inner.clock()
                if left <= 0 and (timeout_s > 0 or self._reading):
                    return b""
                if self._reading:
                    self._changed.wait(READ_S)
                    continue
                came = self._read_once(max(0.0, min(left, READ_S)))
                if not came and timeout_s <= 0:
                    return b""

    def write(self, data: bytes) -> None:
        """Send bytes in one piece: interleaved requests of two sheets are invalid."""
        with self._writing:
            self.inner.write(data)

    def _check(self, sheet: SheetPort) -> None:
        if self.failure is not None:
            raise self.failure
        name = self.inner.name
        if self._sorter.alone:
            raise PortNotFound(f"{sheet.name}: the board at {name} has one sheet, without a number; open {name}")
        if (sheets := self._sorter.sheets) is not None and sheet.number >= sheets:
            raise PortNotFound(f"{sheet.name}: the board at {name} has the sheets 0 to {sheets - 1}")

    def _read_once(self, seconds: float) -> bool:
        self._reading = True
        self._changed.release()
        data, failure = b"", None
        try:
            data = self.inner.read(seconds)
        except Exception as error:  # of all sheets
            failure = error
        finally:
            self._changed.acquire()
            self._reading = False
            self.failure = failure
            self._changed.notify_all()
        for number, packet in self._sorter.take(data):
            for sheet, waiting in self._waiting.items():
                if number is None or number == sheet.number:
                    waiting.append(packet)
        return bool(data)


class SheetPort:
    """A sheet at a shared port: a :class:`~contactfpga.driver.transport.Transport`."""

    def __init__(self, name: str, number: int, shared: SharedPort):
        self.name, self.number = name, number
        self.live, self.threaded = shared.inner.live, shared.inner.threaded
        self.clock, self.skins = shared.inner.clock, skins_of(shared.inner)
        self._shared = shared
        shared.add(self)

    def read(self, timeout_s: float) -> bytes:
        return self._shared.read(self, timeout_s)

    def write(self, data: bytes) -> None:
        self._shared.write(numbered_requests(data, self.number))

    def close(self) -> None:
        _give_back(self, self._shared)


class Greetings:
    """Hellos of the sheets at a port, without requests."""

    def __init__(self, port: str):
        self.heard: dict[str, Hello] = {}
        self._port = port
        self._sorter = Sorter()
        self._conversations: dict[int, Conversation] = {}

    def take(self, data: bytes, now: float) -> bool:
        """Add bytes; returns whether the hellos of all sheets are known."""
        for number, packet in self._sorter.take(data):
            if number is None:
                continue
            name = f"{self._port}#{number}"
            conversation = self._conversations.setdefault(number, Conversation(name))
            for event in conversation.receive(packet, now):
                if isinstance(event, Hello):
                    self.heard[name] = event
        return len(self.heard) == self._sorter.sheets


_open: dict[str, SharedPort] = {}
_lock = threading.Lock()


@forks.in_child
def _begin_anew() -> None:
    global _lock
    _lock = threading.Lock()
    _open.clear()


def share(address: SheetOf, baud: int, connect: Callable[[str, int], Transport] = connect) -> SheetPort:
    """A sheet at a port, which ``connect`` opens unless it is open."""
    port, number = address.port, address.number
    with _lock:
        shared = _open.get(port)
        if shared is None or shared.failure is not None:
            shared = _open[port] = SharedPort(connect(port, baud), baud)
        elif shared.baud != baud:
            raise ContactFPGAError(
                f"{port}#{number}: another sheet at this port is open at {shared.baud} baud; give baud = {shared.baud}"
            )
        return SheetPort(f"{port}#{number}", number, shared)


def open_at(port: str) -> list[str]:
    """Ports of the sheets at a port, if it is open in this process."""
    with _lock:
        shared = _open.get(port)
        return [] if shared is None or shared.failure is not None else shared.names


def _give_back(sheet: SheetPort, shared: SharedPort) -> None:
    with _lock:
        if shared.drop(sheet):
            if _open.get(shared.inner.name) is shared:
                del _open[shared.inner.name]
            shared.inner.close()
