"""How far each assumption about a kit moves its headlines."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from contactfpga.design import kits
from contactfpga.design.cover import Body, Cover, load_cover
from contactfpga.design.cover.numerics import Floats
from contactfpga_sim.apps import errors, pool
from contactfpga_sim.apps.latency import stages
from contactfpga_sim.apps.latency.usb import BridgeSettings
from contactfpga_sim.lab import writer
from contactfpga_sim.lab.arm import kits as kits_arm
from contactfpga_sim.lab.arm import places
from contactfpga_sim.lab.arm.anywhere import WAYS
from contactfpga_sim.lab.arm.case import Case
from contactfpga_sim.lab.kits import predict
from contactfpga_sim.model.scenes.families import placements

KIT = kits.kit("starter")
TOUCHES, SCENES = 16, 500
"""Touches of an arm and scenes of fingers, the same for each assumption."""
LATE_US = 100.0

CHANGES: dict[str, tuple[dict[str, float], ...]] = {
    "flesh of fingers half / twice as stiff": ({"flesh": 0.5}, {"flesh": 2.0}),
    "fingers and arm 25 % narrower / wider": ({"patch": 0.75}, {"patch": 1.25}),
    "foam half / twice as stiff": ({"foam": 0.5}, {"foam": 2.0}),
    "foam 10 % thinner / thicker": ({"thickness": 0.9}, {"thickness": 1.1}),
    "domes 10 % weaker / stronger": ({"force": 0.9}, {"force": 1.1}),
    "travel 25 % shorter / longer": ({"travel": 0.75}, {"travel": 1.25}),
    "caps tilt: each closes within 4 %": ({"tilt": predict.TILT},),
    f"electronics {LATE_US:g} us later": ({"late_us": LATE_US},),
}
"""Factors of :func:`contactfpga_sim.lab.kits.predict.pressing`, or a delay."""


class Headlines(NamedTuple):
    """What a set of assumptions comes to."""

    felt_n: float
    """Force from which half of all fingers are felt, anywhere."""
    told_ms: float
    """Time from a finger's first touch of the foam, on a switch, to the controller's input."""
    rigid_n: float
    """Mean peak force of an arm that runs into a rigid one by UART, anywhere."""
    forearm_n: float
    wrong: Floats
    """(scenes,): 1 for a miscounted one."""


def headlines(changes: Mapping[str, float], touches: int = TOUCHES, scenes: int = SCENES) -> Headlines:
    """What the kit comes to with one of :data:`CHANGES`, or as stated."""
    of = {"patch": 1.0, "late_us": 0.0, **changes}
    late_s, stated = 1e-6 * of.pop("late_us"), load_cover(KIT.skin_path)
    assert stated is not None
    one = predict.pressing(stated, of)
    found = predict.measured(predict.pressing(stated, {"spread": 0.0, **of}), KIT.skin, 0)  # usual switches
    latencies = tuple(late_s + each for each in _usual_s())
    rigid_n, forearm_n = (_peak_n(one.cover, body, of["patch"], latencies, touches) for body in ("rigid", "forearm"))
    told_ms = found["first_closing_ms"] + 1e3 * float(np.median(latencies))
    wide = one.body._replace(depth_m=one.body.depth_m / of["patch"] ** 2)  # the same curvature as of a wider patch
    wrong = np.fromiter(_miscounted(one.cover, wide, scenes), float)
    return Headlines(found["felt_half_n"], told_ms, rigid_n, forearm_n, wrong)


@functools.cache
def _usual_s() -> places.Latencies:
    """The kit's own times in s from a closed switch to the controller's input, by UART and USB."""
    finger = stages.measure(KIT.skin, BridgeSettings(KIT.board.bridge), host_touches=0)
    return kits_arm.ways(KIT.skin, finger)[WAYS.index("UART")]


def _peak_n(cover: Cover, body: str, wide: float, latencies: places.Latencies, touches: int) -> float:
    case = Case.load("paper").wearing(cover)
    case = case.but(body=body, foam={"radius_m": case.foam.radius_m * wide})
    batches = places.batches(case, KIT.skin, (latencies,), touches)
    return float(np.mean([force for batch in batches for force, *_ in places.work(batch)[0]]))


def _miscounted(cover: Cover, body: Body, count: int) -> Iterator[bool]:
    for scene in placements("fingers", count, 0, KIT.skin):
        contacts = tuple(dataclasses.replace(one, body=body) for one in scene.contacts)
        cells, there = errors.look(dataclasses.replace(scene, contacts=contacts), 0.0, KIT.skin, cover)
        yield len(errors.method_zones(cells, KIT.skin)) != len(there)


HEAD = (
    "assumption",
    "half of fingers felt from",
    f"foam touched at {predict.SPEED_MM_S:g} mm/s to the controller",
    "arm's mean peak force, rigid",
    "the same, forearm",
    f"fingers miscounted, {SCENES} scenes",
)


def sensitivity_table() -> writer.Table:
    with pool.executor() as workers:
        usual, *others = workers.map(headlines, [{}, *(one for both in CHANGES.values() for one in both)])
    newtons = (f"{force:.3g} N" for force in (usual.rigid_n, usual.forearm_n))
    share = f"{100 * usual.wrong.mean():.1f} %"
    stated = (f"{usual.felt_n:.2g} N", f"{usual.told_ms:.3g} ms", *newtons, share)
    rows, left = [], iter(others)
    for name, changes in CHANGES.items():
        cells = [_moved(next(left), usual) for _ in changes]
        rows.append((name, *map(" / ".join, zip(*cells, strict=True))))
    before = "; ".join(f"{name} {value}" for name, value in zip(HEAD[1:], stated, strict=True))
    return writer.Table(HEAD, rows, before=f"As stated: {before}.")


def _moved(one: Headlines, usual: Headlines) -> list[str]:
    """Relative changes, and the difference of the shares with its 95 % interval, in points."""
    moved = [f"{100 * (now / before - 1):+z.0f} %" for now, before in zip(one[:-1], usual[:-1], strict=True)]
    more = 100 * (one.wrong - usual.wrong)
    return [*moved, f"{more.mean():+z.1f} ± {1.96 * more.std() / math.sqrt(len(more)):.1f}"]
