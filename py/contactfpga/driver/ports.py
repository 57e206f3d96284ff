"""Serial ports that may be a supported board, by their USB ids."""

from __future__ import annotations

import dataclasses
import itertools
import os
from collections.abc import Iterable

from contactfpga.boards import BOARDS
from contactfpga.boards.spec import BoardSpec
from contactfpga.inputs.values import visible


@dataclasses.dataclass(frozen=True)
class Usb:
    """USB ids of a board's serial port."""

    vid: int
    pid: int
    interface: int | None
    """Interface that carries the serial port where the chip has several; None: any."""
    boards: str


def supported(boards: Iterable[BoardSpec]) -> tuple[Usb, ...]:
    """The boards by the chip that carries their UART, each chip once."""
    titles: dict[tuple[int, int, int | None], list[str]] = {}
    for board in boards:
        titles.setdefault((*board.bridge.usb, board.bridge.interface), []).append(board.title)
    return tuple(Usb(*chip, ", ".join(names)) for chip, names in titles.items())


SUPPORTED = supported(BOARDS.values())


@dataclasses.dataclass(frozen=True)
class Candidate:
    """A port that could be a board."""

    device: str
    boards: str
    serial_number: str | None = None

    def __str__(self) -> str:
        # A USB device says what it likes of itself.
        number = f", serial number {visible(self.serial_number)}" if self.serial_number else ""
        return f"{visible(self.device)} ({self.boards}{number})"


MORE = "CONTACTFPGA_PORTS"
"""Environment variable with more ports to search, separated as in PATH: those that have no USB ids."""


def candidates() -> list[Candidate]:
    """Ports with the USB ids of supported boards, in the order of their names, and those of :data:`MORE`."""
    from serialx import list_serial_ports

    found = choose(list_serial_ports())
    there = {one.device for one in found}
    more = dict.fromkeys(device for device in os.environ.get(MORE, "").split(os.pathsep) if device)
    return found + [Candidate(device, f"in {MORE}") for device in more if device not in there]


def choose(ports: Iterable[object]) -> list[Candidate]:
    """The ports among ``ports`` (objects like serialx.SerialPortInfo) that may be a supported board.

    Where the system does not tell the interface number, every port of a chip is a candidate.
    """
    found = []
    for port, usb in itertools.product(ports, SUPPORTED):
        if (getattr(port, "vid", None), getattr(port, "pid", None)) != (usb.vid, usb.pid):
            continue
        interface = getattr(port, "interface_num", None)
        if usb.interface is None or interface is None or interface == usb.interface:
            found.append(Candidate(str(port.device), usb.boards, getattr(port, "serial_number", None)))  # type: ignore[attr-defined]
    return sorted(found, key=lambda candidate: candidate.device)
