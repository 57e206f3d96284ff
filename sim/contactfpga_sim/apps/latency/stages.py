"""The stages from a touch to user code."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

from contactfpga.errors import ContactFPGAError
from contactfpga.skin import Skin
from contactfpga_sim.apps.latency import board as latency
from contactfpga_sim.apps.latency import host
from contactfpga_sim.apps.latency.board import Latency
from contactfpga_sim.apps.latency.host import HostShare
from contactfpga_sim.apps.latency.spread import MEDIAN, MOST, MixedTimes, Spread, summed
from contactfpga_sim.apps.latency.usb import HOST_S, BridgeSettings, delivered

PAPER_US = 6000.0
"""The paper's time from a touch to the decision to turn back."""

ASSUMED_HOST_US = 1e6 * HOST_S
"""Time from the host's USB controller to the decision, as in ``contactfpga study arm``."""


class TooFast(ContactFPGAError, ValueError):
    """The bridge does not reach the Skin's baud rate."""


@dataclasses.dataclass(frozen=True)
class Finger:
    """Results of :func:`measure`, in us; all but ``host`` and ``user_code_us`` are exact."""

    board: Latency
    settings: BridgeSettings
    bridge_us: Spread
    """Time from the last byte on the wire to the host's USB controller."""
    usb_us: Spread
    """Time from the touch to the host's USB controller."""
    host: HostShare | None
    user_code_us: Spread | None
    """Time from the touch to user code: each exact time with each measured one."""

    @property
    def decision_us(self) -> Spread:
        """Time from the touch to the decision, with :data:`ASSUMED_HOST_US`."""
        return Spread(*(us + ASSUMED_HOST_US for us in dataclasses.astuple(self.usb_us)))

    def as_json(self) -> dict[str, Any]:
        board = dataclasses.asdict(dataclasses.replace(self.board, recorded=()))
        del board["recorded"]
        shares = self.host
        measured = {name: getattr(shares, name) for name in ("touches", "left_out", "machine")} if shares else {}
        return board | {
            "bridge": {
                "chip": self.settings.chip.chip,
                "frame_us": self.settings.chip.frame_us,
                "latency_timer_ms": self.settings.timer_ms,
                "event_character": self.settings.event,
                "requests_per_frame": self.settings.asks,
            },
            "last_byte_to_host_us": dataclasses.asdict(self.bridge_us),
            "touch_to_host_us": dataclasses.asdict(self.usb_us),
            "host": measured | {"us": dataclasses.asdict(shares.us)} if shares else None,
            "touch_to_user_code_us": dataclasses.asdict(self.user_code_us) if self.user_code_us else None,
            "assumed_host_us": ASSUMED_HOST_US,
            "touch_to_decision_us": dataclasses.asdict(self.decision_us),
            "paper_touch_to_decision_us": PAPER_US,
        }


def measure(
    skin: Skin,
    settings: BridgeSettings,
    cells: tuple[int, int] = (3, 3),
    touches: int | None = None,
    *,
    host_touches: int = host.TOUCHES,
    step: Callable[[str, int], None] = lambda name, of: None,
) -> Finger:
    """The board's stages by :func:`.board.measure`, the bridge's over all phases, and the host's over ``host_touches``,
    0 for none.

    Raises ValueError for a contact that does not fit, :class:`TooFast`, and :class:`~.board.Late`.
    """
    chip = settings.chip
    if skin.baud > chip.max_baud:
        raise TooFast(
            f"baud is {skin.baud}, the {chip.chip} reaches {chip.max_baud} at most; name a board with a faster one"
        )
    frame, period = chip.frame_us, settings.period_us
    board = latency.measure(skin, cells, touches, step, around_us=(2 * period + frame, period + 2 * frame))
    us = skin.clock_hz / 1e6
    late = [delivered(settings, skin.clock_hz, one.stream, one.byte) for one in board.recorded]
    usb = MixedTimes.mixed(late)
    bridge = MixedTimes.mixed(times.later(-one.last / us) for times, one in zip(late, board.recorded, strict=True))
    share = host.measured(skin, settings, latency.places(skin, *cells), host_touches, step) if host_touches else None
    code = None
    if share is not None:
        code = Spread(*(summed(usb, share.times, part) for part in (MEDIAN, MOST, 1.0)))
    return Finger(board, settings, bridge.spread(), usb.spread(), share, code)
