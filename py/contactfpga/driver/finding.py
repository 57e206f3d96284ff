"""Search for a board's port: the only one, the one of a Skin, ``name:LEFT``, ``usb:SERIAL``.

A search only listens at ports with USB ids of supported boards: boards say hello twice per second unasked, and foreign
devices with the same USB chip must get no byte. A port that another program reads is skipped untouched.
"""

from __future__ import annotations

import dataclasses
import itertools
import os
import time
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor

from contactfpga.boards import BOARDS
from contactfpga.boards.spec import BoardSpec
from contactfpga.driver import sheets
from contactfpga.driver.address import NAME, USB, SheetOf
from contactfpga.driver.conversation import Conversation
from contactfpga.driver.transport import connect
from contactfpga.errors import BoardSilent, ContactFPGAError, OnlyNoise, PortBusy, PortNotFound
from contactfpga.inputs.values import visible
from contactfpga.skin import Skin
from contactfpga.wire.hello import Hello, describe


@dataclasses.dataclass(frozen=True)
class Usb:
    vid: int
    pid: int
    interface: int | None
    """Interface of the serial port on a chip with several; None: any."""
    boards: str


def supported(boards: Iterable[BoardSpec]) -> tuple[Usb, ...]:
    """USB ids of the chips that carry the boards' UARTs, each chip once."""
    titles: dict[tuple[int, int, int | None], list[str]] = {}
    for board in boards:
        titles.setdefault((*board.bridge.usb, board.bridge.interface), []).append(board.title)
    return tuple(Usb(*chip, ", ".join(names)) for chip, names in titles.items())


SUPPORTED = supported(BOARDS.values())


@dataclasses.dataclass(frozen=True)
class Candidate:
    device: str
    boards: str
    serial_number: str | None = None

    def __str__(self) -> str:
        # A USB device says what it likes of itself.
        number = f", serial number {visible(self.serial_number)}" if self.serial_number else ""
        return f"{visible(self.device)} ({self.boards}{number})"


MORE = "CONTACTFPGA_PORTS"
"""Environment variable with ports to search that have no USB ids, separated as in PATH."""


def candidates() -> list[Candidate]:
    """Ports with USB ids of supported boards, by name, and those of :data:`MORE`."""
    from serialx import list_serial_ports

    found = choose(list_serial_ports())
    there = {one.device for one in found}
    more = dict.fromkeys(device for device in os.environ.get(MORE, "").split(os.pathsep) if device)
    return found + [Candidate(device, f"in {MORE}") for device in more if device not in there]


def choose(ports: Iterable[object]) -> list[Candidate]:
    """Those of ``ports`` (objects like serialx.SerialPortInfo) that may be a supported board: every port of a chip if
    the system does not tell interface numbers.
    """
    found = []
    for port, usb in itertools.product(ports, SUPPORTED):
        if (getattr(port, "vid", None), getattr(port, "pid", None)) != (usb.vid, usb.pid):
            continue
        interface = getattr(port, "interface_num", None)
        if usb.interface is None or interface is None or interface == usb.interface:
            found.append(Candidate(str(port.device), usb.boards, getattr(port, "serial_number", None)))  # type: ignore[attr-defined]
    return sorted(found, key=lambda candidate: candidate.device)


LISTEN_S = 1.2
"""Longest wait for a hello; boards send one every 0.5 s."""
PATIENT_S = 8.0
"""Longest wait if frames may be arriving: a virtual board may be slower than its clock."""


@dataclasses.dataclass(frozen=True)
class Reply:
    """The result of listening to a port."""

    candidate: Candidate
    hello: Hello | None
    """None: no board said hello."""
    problem: str
    """Reason for the missing hello; "" if there is one."""
    busy: bool = False

    def __str__(self) -> str:
        said = self.problem if self.hello is None else f"says hello: {describe(self.hello)}"
        return f"{self.candidate}: {said}"


def find(port: str | None, skin: Skin | None, baud: int) -> str:
    """The device of the one matching board. Raises :class:`PortNotFound`, which lists all boards, and :class:`PortBusy`
    if it may be at an open port.
    """
    if port is not None and (sheet := SheetOf.parse(port)) is not None:
        return f"{find(sheet.port, None, baud)}#{sheet.number}"
    found = candidates()
    if port is not None and port.startswith(USB):
        found = _with_number(port.removeprefix(USB), found)
        if len(found) == 1:
            return found[0].device
    if not found:
        known = ", ".join(f"{usb.vid:04x}:{usb.pid:04x} ({usb.boards})" for usb in SUPPORTED)
        raise PortNotFound(
            f"no supported board is plugged in (USB ids {known}); name its port, or 'sim://' for the simulated board"
        )
    heard = survey(found, baud)
    meant = _meant(heard, port, skin)
    if len(meant) == 1:
        return meant[0].candidate.device
    report = "; ".join(map(str, heard))
    if not meant:
        busy = any(one.busy for one in heard)
        raise (PortBusy if busy else PortNotFound)(f"{_nobody(port, skin, heard)}. Candidates: {report}")
    raise PortNotFound(f"several boards answer{_of(port, skin)}; name one of them{_hint(meant)}. Candidates: {report}")


def survey(candidates: Sequence[Candidate], baud: int) -> list[Reply]:
    if not candidates:
        return []
    with ThreadPoolExecutor(len(candidates)) as pool:
        heard = pool.map(lambda one: _heard(one, baud), candidates)
        return [found for at_one_port in heard for found in at_one_port]


def _heard(candidate: Candidate, baud: int) -> list[Reply]:
    try:
        names = sheets.open_at(candidate.device) or [candidate.device]
        heard = [one for name in names for one in listen(name, baud).items()]
        return [Reply(dataclasses.replace(candidate, device=name), hello, "") for name, hello in heard]
    except ContactFPGAError as error:
        return [Reply(candidate, None, str(error), isinstance(error, PortBusy))]


def listen(device: str, baud: int, seconds: float | None = None) -> dict[str, Hello]:
    """Hellos sent unasked at this port within ``seconds``, by the port to open."""
    seconds = LISTEN_S if seconds is None else seconds
    transport = connect(device, baud)
    of_sheets = sheets.Greetings(device)
    try:
        conversation = Conversation(device)
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0:
            if conversation.stats.before_hello and seconds < PATIENT_S:  # what may be frames
                until, seconds = until + PATIENT_S - seconds, PATIENT_S
                continue
            data = transport.read(left)
            if of_sheets.take(data, time.monotonic()):
                return of_sheets.heard
            for event in conversation.receive(data, time.monotonic()):
                if isinstance(event, Hello):
                    return {device: event}
                if isinstance(event, ContactFPGAError):
                    raise event
    finally:
        transport.close()
    if of_sheets.heard:
        return of_sheets.heard
    came = conversation.stats.bytes
    if came:
        raise OnlyNoise(f"{came} bytes came, but no hello; is the baud rate the Skin's? Asked for was {baud}")
    raise BoardSilent(f"not one byte came within {seconds:g} s")


def _with_number(number: str, candidates: Iterable[Candidate]) -> list[Candidate]:
    candidates = list(candidates)
    found = [one for one in candidates if one.serial_number == number]
    if not found:
        there = ", ".join(visible(one.serial_number) for one in candidates if one.serial_number)
        others = f"; there is {there}" if there else ", nor any other with a serial number"
        raise PortNotFound(f"no board with USB serial number {visible(number)} is plugged in{others}")
    return found


def _meant(heard: Sequence[Reply], port: str | None, skin: Skin | None) -> list[Reply]:
    found = [one for one in heard if one.hello is not None]
    if port is not None and port.startswith(NAME):
        found = _named(found, port.removeprefix(NAME))
        if len(found) == 1:  # of another Skin, too: whoever opens it says so
            return found
    if skin is not None:
        found = [one for one in found if one.hello is not None and one.hello.fingerprint == skin.fingerprint]
        if len(found) > 1 and skin.name:
            found = _named(found, skin.name) or found
    return found


def _named(found: Sequence[Reply], name: str) -> list[Reply]:
    return [one for one in found if one.hello is not None and one.hello.name == name]


def _of(port: str | None, skin: Skin | None) -> str:
    name = f" named {visible(port.removeprefix(NAME))!r}" if port is not None and port.startswith(NAME) else ""
    return name + (f" with fingerprint {skin.fingerprint.hex()}" if skin is not None else "")


def _nobody(port: str | None, skin: Skin | None, heard: Sequence[Reply]) -> str:
    if not any(one.hello for one in heard):
        return "no board answers"
    return f"no board{_of(port, skin)} is here"


def _hint(meant: Sequence[Reply]) -> str:
    names = [one.hello.name for one in meant if one.hello is not None]
    numbers = [one.candidate.serial_number for one in meant]
    for scheme, keys in ((NAME, names), (USB, numbers)):
        if all(keys) and len(set(keys)) == len(keys):
            return ": " + " or ".join(f"{scheme}{visible(key or '')}" for key in keys)
    return ""
