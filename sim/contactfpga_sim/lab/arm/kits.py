"""Peak forces of the paper's arm under each kit's own cover, with the kit's own latencies."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from contactfpga.design import kits
from contactfpga.design.cover import Cover, load_cover
from contactfpga.design.kits import Kit
from contactfpga.skin import Skin
from contactfpga_sim.apps import light
from contactfpga_sim.apps.latency import stages
from contactfpga_sim.apps.latency.spread import MixedTimes
from contactfpga_sim.apps.latency.stages import Finger
from contactfpga_sim.apps.latency.usb import HOST_S, BridgeSettings, delivered
from contactfpga_sim.lab.arm import anywhere, places
from contactfpga_sim.lab.arm.anywhere import WAYS, Found
from contactfpga_sim.lab.arm.case import Case
from contactfpga_sim.lab.arm.places import Batch, Latencies, Peaks

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


LIGHT = "starter, light cells"
"""The starter kit's foam and pads on the cells, and with the times, of the example with levels."""


class Worn(NamedTuple):
    """A sheet on the arm."""

    name: str
    skin: Skin
    cover: Cover | None
    finger: Finger
    """Its times from a touch to the host's USB controller."""


def worn(kit: Kit, finger: Finger) -> Worn:
    return Worn(kit.name, kit.skin, load_cover(kit.skin_path), finger)


def fingers() -> list[Worn]:
    """The kits, and light cells in the place of a kit's domes."""

    def measured(kit: Kit, skin: Skin) -> Finger:
        return stages.measure(skin, BridgeSettings(kit.board.bridge), host_touches=0)

    found = [worn(kit, measured(kit, kit.skin)) for kit in map(kits.kit, kits.names())]
    starter, (skin, _, cell) = kits.kit("starter"), light.example()
    cover = load_cover(starter.skin_path)
    assert cover is not None
    cover = dataclasses.replace(cover, cell=cell, switch=cell.switch)
    return [*found, Worn(LIGHT, skin, cover, measured(starter, skin))]


def ways(skin: Skin, finger: Finger) -> tuple[Latencies, ...]:
    """Latencies of :data:`WAYS`; by UART and pin the sheet's, of all touches and phases of its bridge."""
    touches, hz = finger.board.recorded, skin.clock_hz
    usb = MixedTimes.mixed(delivered(finger.settings, hz, one.stream, one.byte) for one in touches)
    pin = np.quantile([one.pin / hz for one in touches], SHARES)
    return (6e-3,), tuple(HOST_S + 1e-6 * usb.quantile(share) for share in SHARES), tuple(pin.tolist()), ()


def study(
    fingers: Iterable[Worn], bodies: tuple[str, ...] = BODIES, times: tuple[int, ...] = (1, 2)
) -> dict[Collision, list[Batch]]:
    """Batches of touches anywhere, under the kits and the paper's sheets, at these times the case's speed."""
    paper = Case.load("paper")
    known, speed = anywhere.ways(paper, Skin()), paper.link.speed_m_s
    sheets = [(one.name, paper.wearing(one.cover), one.skin, ways(one.skin, one.finger)) for one in fingers]
    sheets += [(name, sheet.case(), Skin(), known) for name, sheet in PAPER_SHEETS.items()]
    return {
        Collision(name, body, each * speed): places.batches(
            case.but(body=body, link={"speed_m_s": each * speed}), skin, latencies, anywhere.TOUCHES
        )
        for name, case, skin, latencies in sheets
        for body in (bodies if case.model == "foam" else ("rigid",))
        for each in times
    }


def depth_text(halves: Sequence[Peaks]) -> str:
    """Worst and mean depth in mm when the contact arrived; of touches that came to the controller."""
    depths = 1e3 * np.concatenate([half.detected_m for half in halves])
    known = depths[~np.isnan(depths)]
    return f"{known.max():.2f} / {known.mean():.2f}" if len(known) else ""


DEPTH = "depth at UART's contact: worst / mean, mm"


def lines(found: Mapping[Collision, Found]) -> list[list[str]]:
    told = [["sheet", "body", "speed, m/s", *(f"{way}: worst / mean, N" for way in WAYS), DEPTH]]
    return told + [
        [*each[:2], f"{each.speed_m_s:g}", *map(anywhere.peak_text, halves), depth_text(halves[1])]
        for each, halves in found.items()
    ]
