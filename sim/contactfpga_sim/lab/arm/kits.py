"""Peak forces of the paper's arm under each kit's own cover, with the kit's own latencies."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from contactfpga.design import kits
from contactfpga.design.cover import load_cover
from contactfpga.design.kits import Kit
from contactfpga.skin import Skin
from contactfpga_sim.apps.latency import stages
from contactfpga_sim.apps.latency.spread import MixedTimes
from contactfpga_sim.apps.latency.stages import Finger
from contactfpga_sim.apps.latency.usb import HOST_S, BridgeSettings, delivered
from contactfpga_sim.lab.arm import anywhere, places
from contactfpga_sim.lab.arm.anywhere import WAYS, Found
from contactfpga_sim.lab.arm.case import Case
from contactfpga_sim.lab.arm.places import Batch, Latencies

BODIES = ("forearm", "palm", "rigid")

PAPER_SHEETS = {"paper, point force": anywhere.PAPER, "paper": anywhere.FLUSH}
"""The paper's sheet on its half-space, which knows rigid bodies alone, and as layers like the kits."""

SHARES = (np.arange(50) + 0.5) / 50
"""Quantiles of a kit's latencies."""


class Collision(NamedTuple):
    """An arm under a sheet that runs into a body."""

    sheet: str
    """Name of a kit, or of :data:`PAPER_SHEETS`."""
    body: str
    speed_m_s: float


def fingers() -> list[tuple[Kit, Finger]]:
    """Each kit with its times from a touch to the host's USB controller."""
    found = map(kits.kit, kits.names())
    return [(kit, stages.measure(kit.skin, BridgeSettings(kit.board.bridge), host_touches=0)) for kit in found]


def ways(kit: Kit, finger: Finger) -> tuple[Latencies, ...]:
    """Latencies of :data:`WAYS`; by UART and pin the kit's, of all touches and phases of its bridge."""
    touches, hz = finger.board.recorded, kit.skin.clock_hz
    usb = MixedTimes.mixed(delivered(finger.settings, hz, one.stream, one.byte) for one in touches)
    pin = np.quantile([one.pin / hz for one in touches], SHARES)
    return (6e-3,), tuple(HOST_S + 1e-6 * usb.quantile(share) for share in SHARES), tuple(pin.tolist()), ()


def study(
    fingers: Iterable[tuple[Kit, Finger]], bodies: tuple[str, ...] = BODIES, times: tuple[int, ...] = (1, 2)
) -> dict[Collision, list[Batch]]:
    """Batches of touches anywhere, under the kits and the paper's sheets, at these times the case's speed."""
    paper = Case.load("paper")
    known, speed = anywhere.ways(paper, Skin()), paper.link.speed_m_s
    sheets = [
        (one.name, paper.wearing(load_cover(one.skin_path)), one.skin, ways(one, finger)) for one, finger in fingers
    ]
    sheets += [(name, sheet.case(), Skin(), known) for name, sheet in PAPER_SHEETS.items()]
    return {
        Collision(name, body, each * speed): places.batches(
            case.but(body=body, link={"speed_m_s": each * speed}), skin, latencies, anywhere.TOUCHES
        )
        for name, case, skin, latencies in sheets
        for body in (bodies if case.model == "foam" else ("rigid",))
        for each in times
    }


def lines(found: Mapping[Collision, Found]) -> list[list[str]]:
    told = [["sheet", "body", "speed, m/s", *(f"{way}: worst / mean, N" for way in WAYS)]]
    return told + [
        [*each[:2], f"{each.speed_m_s:g}", *map(anywhere.peak_text, halves)] for each, halves in found.items()
    ]
