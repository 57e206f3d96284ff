"""Status of a link whose board is unplugged, muted or exchanged."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np

import contactfpga
from contactfpga.robot.body.plan import Plan, read
from contactfpga.robot.body.reader import LinkReader
from contactfpga.skin import Skin
from contactfpga_sim.model.board.virtual import VirtualBoard

SKIN = Skin()
OTHER = Skin(connectivity=4)
LONGEST_S = 5.0
BEFORE_S = 0.05


class Socket:
    """A simulated port at which boards are exchanged."""

    def __init__(self) -> None:
        self.now = 0.0
        self.board: VirtualBoard | None = None
        self.plugs = 0
        self.mute = self.noisy = False
        self.held_s = 0.0
        self._held: list[tuple[float, bytes]] = []
        self._random = np.random.default_rng(1)

    def plug(self, skin: Skin = SKIN) -> None:
        self.flash(skin)
        self.plugs += 1

    def flash(self, skin: Skin = SKIN) -> None:
        self.board = VirtualBoard(skin, "two_fingers")
        self._held.clear()

    def unplug(self) -> None:
        self.board = None
        self.plugs += 1

    def opened(self, plan: Plan) -> contactfpga.Board:
        if self.board is None:
            raise contactfpga.PortNotFound("no such port")
        return contactfpga.open(HeldPort(self), plan.skin, timeout=0.2)

    def pass_(self, seconds: float) -> bytes:
        """Let time pass; return the bytes that arrived."""
        assert self.board is not None
        before = self.board.clock()
        data = self.board.read(seconds)
        self.now += self.board.clock() - before
        if self.noisy:
            data = self._random.integers(0, 256, len(data), np.uint8).tobytes()
        self._held.append((self.now + self.held_s, b"" if self.mute else data))
        due = b"".join(data for when, data in self._held if when <= self.now)
        self._held = [(when, data) for when, data in self._held if when > self.now]
        return due


class HeldPort:
    """A port that lives as long as its board."""

    def __init__(self, socket: Socket):
        self._socket, self._plug = socket, socket.plugs

    def _check(self) -> None:
        if self._socket.plugs != self._plug:
            raise contactfpga.PortLost("the port is gone")

    def read(self, seconds: float) -> bytes:
        self._check()
        until = self._socket.now + seconds
        while not (data := self._socket.pass_(max(1e-6, until - self._socket.now))) and self._socket.now < until:
            self._check()
        return data

    def write(self, data: bytes) -> None:
        self._check()
        if self._socket.board is not None:
            self._socket.board.write(data)

    def clock(self) -> float:
        return self._socket.now

    def close(self) -> None:
        """The board stays."""


@dataclasses.dataclass(frozen=True)
class Outage:
    name: str
    begin: Callable[[Socket], object]
    end: Callable[[Socket], object]
    status: str


def _set(**values: object) -> Callable[[Socket], object]:
    def change(socket: Socket) -> None:
        for name, value in values.items():
            setattr(socket, name, value)

    return change


OUTAGES = (
    Outage("unplugged, then plugged in again", Socket.unplug, Socket.plug, "lost"),
    Outage("sends nothing: no power, a cut wire", _set(mute=True), _set(mute=False), "silent"),
    Outage("sends noise: another baud rate", _set(noisy=True), _set(noisy=False), "silent"),
    Outage("frames are held up for 0.2 s", _set(held_s=0.2), _set(held_s=0.0), "late"),
    Outage("another Skin is flashed, the port stays", lambda one: one.flash(OTHER), Socket.flash, "mismatch"),
    Outage("another board is plugged in", lambda one: one.plug(OTHER), Socket.plug, "mismatch"),
)


@dataclasses.dataclass(frozen=True)
class OutageTimes:
    statuses: tuple[str, ...]
    noticed_s: float
    back_s: float
    stale: int
    """Looks at which an old frame passed for new beyond ``late_s``."""


def play(outage: Outage, folder: Path) -> OutageTimes:
    """Run an outage with the Skin's file in ``folder``. Raises RuntimeError if never reported."""
    (folder / "skin.toml").write_text(SKIN.to_toml(), encoding="utf-8")
    plan = read({"name": "link", "skin": "skin.toml"}, folder)
    socket = Socket()
    socket.plug()
    reader = LinkReader(plan, socket.opened, lambda: socket.now)
    statuses: list[str] = []
    _until(reader, socket, "ok", statuses)
    until_s = socket.now + BEFORE_S
    while socket.now < until_s:
        _step(reader, socket)
    statuses.clear()
    begun_s = socket.now
    outage.begin(socket)
    stale = _until(reader, socket, outage.status, statuses, begun_s + plan.late_s)
    noticed_s = socket.now - begun_s
    ended_s = socket.now
    outage.end(socket)
    _until(reader, socket, "ok", statuses)
    return OutageTimes(tuple(statuses), noticed_s, socket.now - ended_s, stale)


def _until(
    reader: LinkReader, socket: Socket, status: str, seen: list[str], fresh_until_s: float = float("inf")
) -> int:
    """Number of times the link was ok for too long before this status."""
    end_s, stale = socket.now + LONGEST_S, 0
    while (found := reader.state().status) != status:
        if not seen or seen[-1] != found:
            seen.append(found)
        stale += found == "ok" and socket.now > fresh_until_s and socket.held_s > 0
        if socket.now > end_s:
            raise RuntimeError(f"the link is {found} and not {status} after {LONGEST_S:g} s")
        _step(reader, socket)
    seen.append(status)
    return stale


def _step(reader: LinkReader, socket: Socket) -> None:
    before = socket.now
    wait_s = reader.step()
    if socket.now == before:  # nothing to wait for at the port
        socket.now += max(0.001, min(wait_s, 0.01))
