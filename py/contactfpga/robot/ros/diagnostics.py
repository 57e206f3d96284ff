"""How a board fares, as ``diagnostic_msgs``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from contactfpga.robot.ros.convert import Message
from contactfpga.skin.limits import MAX_KEEP_ALIVE_MS
from contactfpga.zones.zone import Zones

if TYPE_CHECKING:
    from contactfpga.driver.driver import Board

OK, WARN, ERROR = range(3)
WAITED_S = 0.25
"""Frames that wait for longer until they are taken are told."""

_COUNTED = ("frames", "lost", "dropped", "overwritten", "resynchronized", "restarts", "skin_changes")
_TROUBLE = ("lost", "damaged", "dropped", "restarts")
"""Of these a new one since the last message is a warning."""


class Diagnostics:
    """Counts between two messages."""

    def __init__(self, board: Board, name: str, silence_s: float):
        self._board = board
        self._name = name
        self._silence_s = silence_s + (MAX_KEEP_ALIVE_MS / 1000 if board.hello.send == "on_change" else 0)
        self._heard_s = self._since_s = board.clock()
        self._before: dict[str, int] = {}
        self._waited_s = 0.0
        self._flags: set[str] = set()
        self._faults: tuple[str, ...] = ()

    def frame(self, zones: Zones) -> None:
        """A frame came."""
        self._heard_s = self._board.clock()
        if zones.arrived_s is not None:
            self._waited_s = max(self._waited_s, self._heard_s - zones.arrived_s)
        self._flags |= zones.flags
        self._faults = zones.faults

    @property
    def silent(self) -> bool:
        """No frame came for too long."""
        return self._board.clock() - self._heard_s > self._silence_s

    def message(self, head: Message, left_out: int) -> Message:
        """A ``DiagnosticArray`` of what happened since the message before."""
        counts = self._counts() | {"not published": left_out}
        now, frames = self._board.clock(), counts["frames"] - self._before.get("frames", 0)
        rate = frames / (now - self._since_s) if now > self._since_s else 0.0
        level, text = self._said(counts, now)
        values: dict[str, object] = {
            "port": self._board.port,
            "frames per second": f"{rate:.0f}",
            "faults": ", ".join(self._faults),
        }
        found = _array(head, self._name, level, text, self._board.fingerprint.hex(), values | counts)
        self._before, self._since_s = counts, now
        self._waited_s = 0.0
        self._flags.clear()
        return found

    def _counts(self) -> dict[str, int]:
        stats = self._board.stats
        return {name: int(getattr(stats, name)) for name in _COUNTED} | {"damaged": stats.damaged.total()}

    def _said(self, counts: dict[str, int], now: float) -> tuple[int, str]:
        if self.silent:
            return ERROR, f"no frame for {now - self._heard_s:.1f} s; the sheet may be touched"
        said = [f"{counts[name] - self._before.get(name, 0)} {name}" for name in _TROUBLE if self._more(counts, name)]
        said += [f"flagged {flag}" for flag in ("mismatch", "overflow") if flag in self._flags]
        if self._waited_s > WAITED_S:
            said.append(f"frames waited for {self._waited_s:.1f} s: the computer is too busy")
        said += self._faults
        return (WARN, "; ".join(said)) if said else (OK, "frames come")

    def _more(self, counts: dict[str, int], name: str) -> bool:
        return counts[name] > self._before.get(name, 0)


def lost(name: str, why: str, head: Message) -> Message:
    """A ``DiagnosticArray`` where no board is connected."""
    return _array(head, name, ERROR, why, "", {})


def _array(head: Message, name: str, level: int, text: str, hardware: str, values: Mapping[str, object]) -> Message:
    status = {
        "level": level,
        "name": f"contactfpga: {name}",
        "message": text,
        "hardware_id": hardware,
        "values": [{"key": key, "value": str(value)} for key, value in values.items()],
    }
    return {"header": head, "status": [status]}
