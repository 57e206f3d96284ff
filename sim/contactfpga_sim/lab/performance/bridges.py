"""Times from wire to host by the model of the USB bridge, for the boards pages."""

from __future__ import annotations

from typing import NamedTuple

from contactfpga.boards import BOARDS
from contactfpga.shipped import examples
from contactfpga.skin import Skin
from contactfpga_sim.apps.latency import stages
from contactfpga_sim.apps.latency.spread import Spread
from contactfpga_sim.apps.latency.usb import DEFAULT_TIMER_MS, BridgeSettings
from contactfpga_sim.lab import writer

TOUCHES = 24

BRIDGES = {"high speed": BOARDS["icebreaker"].bridge, "full speed": BOARDS["ulx3s-12f"].bridge}

SET = {"set by the rule": {}, "as new": {"timer_ms": DEFAULT_TIMER_MS, "event": None}}
"""Settings of ``contactfpga doctor``, and after power-up."""


class BridgeRow(NamedTuple):
    speed: str
    settings: str
    sheet: str
    skin: Skin


def rows() -> list[BridgeRow]:
    """Each bridge and setting, for sheets that send each scan and that send changes."""
    fast = Skin.load(examples() / "fast.toml")
    found = []
    for speed, chip in BRIDGES.items():
        sheets = {"reference": Skin(), "`fast.toml`": fast.replace(baud=min(fast.baud, chip.max_baud))}
        found += [BridgeRow(speed, settings, sheet, skin) for settings in SET for sheet, skin in sheets.items()]
    return found


def bridge_table() -> str:
    head = ("bridge", "timer, event character", "sheet", "last byte to host, us", "touch to host, us")
    return writer.table(head, map(bridge_row, rows()))


def bridge_row(row: BridgeRow) -> str:
    chip = BRIDGES[row.speed]
    settings = BridgeSettings(chip, **SET[row.settings])  # type: ignore[arg-type]
    found = stages.measure(row.skin, settings, touches=TOUCHES, host_touches=0)
    event = "none" if settings.event is None else str(settings.event)
    baud = f"{row.sheet}, {row.skin.baud / 1e6:g} Mbaud"
    bridge = f"{row.speed}, {chip.frame_us:,} us"
    return writer.line(
        (bridge, f"{settings.timer_ms} ms, {event}", baud, _shown(found.bridge_us), f"**{_shown(found.usb_us)}**")
    )


def bridge_sample() -> str:
    return bridge_row(rows()[0])


def _shown(us: Spread) -> str:
    return f"{us.median:,.0f} / {us.p99:,.0f} / {us.worst:,.0f}"
