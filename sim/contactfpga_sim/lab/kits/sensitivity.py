"""How far each assumption about a kit moves its headlines."""

from __future__ import annotations

import contextlib
import dataclasses
import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from contactfpga.design import kits
from contactfpga.design.cover import load_cover
from contactfpga.design.cover.felt import Force, feel
from contactfpga.design.cover.layers import BODIES
from contactfpga.design.cover.numerics import Floats
from contactfpga_sim.apps import errors, pool
from contactfpga_sim.lab import writer
from contactfpga_sim.lab.arm import places
from contactfpga_sim.lab.arm.case import Case
from contactfpga_sim.lab.chart import methods
from contactfpga_sim.lab.kits import predict
from contactfpga_sim.model.scenes.contacts import Contact
from contactfpga_sim.model.scenes.families import placements

KIT = "starter"
PLACES, TOUCHES, SCENES = 500, 24, 1000
"""Places of a finger, touches of an arm and scenes of fingers, the same for each assumption."""
LATE_US = 100.0

CHANGES: dict[str, tuple[dict[str, float], ...]] = {
    "flesh of finger and forearm half / twice as stiff": ({"flesh": 0.5}, {"flesh": 2.0}),
    "finger and arm 25 % narrower / wider": ({"patch": 0.75}, {"patch": 1.25}),
    "foam half / twice as stiff": ({"foam": 0.5}, {"foam": 2.0}),
    "foam 10 % thinner / thicker": ({"thickness": 0.9}, {"thickness": 1.1}),
    "domes 10 % weaker / stronger": ({"force": 0.9}, {"force": 1.1}),
    "travel 25 % shorter / longer": ({"travel": 0.75}, {"travel": 1.25}),
    "caps tilt: each closes within 4 %": ({"tilt": predict.TILT},),
    f"electronics {LATE_US:g} us later": ({"late_us": LATE_US},),
}
"""Factors of :func:`contactfpga_sim.lab.kits.predict.pressing`, and a delay."""


class Headlines(NamedTuple):
    """What a set of assumptions comes to."""

    felt_n: float
    """Force from which half of all fingers are felt, anywhere."""
    decided_ms: float
    """Time from a finger's first touch of the foam until half of them are felt, and the controller knows."""
    rigid_n: float
    """Mean peak force of an arm that runs into a rigid one by UART, anywhere."""
    forearm_n: float
    wrong: Floats
    """(scenes,): 1 for a miscounted one."""


def headlines(changes: Mapping[str, float], touches: int = TOUCHES, scenes: int = SCENES) -> Headlines:
    """What the kit comes to with one of :data:`CHANGES`, or without."""
    kit, paper, of = kits.kit(KIT), Case.load("paper"), {"flesh": 1.0, "patch": 1.0, "late_us": 0.0} | changes
    stated = load_cover(kit.skin_path)
    assert stated is not None
    assert stated.cap is not None
    late_s = 1e-6 * of.pop("late_us")
    latencies = tuple(one + late_s for one in places.measured_s(paper, kit.skin, "uart"))
    (cover, finger, body), sheet = predict.pressing(stated, of), predict.sheet(kit.skin)
    half = feel(cover, sheet, 2 * finger.half_x_m, 2 * finger.half_y_m, PLACES, body=body).half
    assert isinstance(half, Force)
    depth_m = cover.indentation([finger], body, sheet.pitch_x_m, sheet.pitch_y_m).depth_m(half.value_n)
    foam = {name: getattr(cover, name) for name in ("thickness_m", "modulus_pa", "cut")}
    arm = paper.but(
        model="foam",
        foam=foam | {"radius_m": paper.foam.radius_m * of["patch"]},
        switch=dataclasses.asdict(cover.switch),
        cap=dataclasses.asdict(stated.cap),
    )
    skin = methods.sheet(kit.skin.pitch_x_mm)
    with _softened(of["flesh"]) as ending:
        peaks = []
        for name in ("rigid", "forearm"):
            batches = places.batches(arm.but(body=name + ending), kit.skin, (latencies,), touches)
            peaks.append(float(np.mean([force for batch in batches for force, *_ in places.work(batch)[0]])))
        wrong = []
        for scene in placements("fingers", scenes, 0, skin):
            changed = tuple(_changed(contact, of["patch"], ending) for contact in scene.contacts)
            cells, there = errors.look(dataclasses.replace(scene, contacts=changed), 0.0, skin, cover)
            wrong.append(errors.errors(errors.method_zones(cells, skin), there).miscounted)
    decided_ms = 1e6 * depth_m / predict.SPEED_MM_S + 1e3 * float(np.median(latencies))
    return Headlines(half.value_n, decided_ms, *peaks, np.array(wrong, float))


@contextlib.contextmanager
def _softened(factor: float) -> Iterator[str]:
    """Bodies whose flesh has its modulus times a factor, known for a while by their names with this ending."""
    ending = f", flesh times {factor:g}"
    others = {name + ending: predict.softened(body, factor) for name, body in BODIES.items()}
    BODIES.update(others)
    try:
        yield ending
    finally:
        for name in others:
            del BODIES[name]


def _changed(contact: Contact, wide: float, ending: str) -> Contact:
    shape = contact.shape
    assert isinstance(shape, tuple)
    parts = (dataclasses.replace(one, half_x_m=one.half_x_m * wide, half_y_m=one.half_y_m * wide) for one in shape)
    return dataclasses.replace(contact, shape=tuple(parts), body=f"{contact.body}{ending}")


HEAD = (
    "assumption",
    "half of fingers felt from",
    f"foam touched at {predict.SPEED_MM_S:g} mm/s to the controller",
    "arm's mean peak force, rigid",
    "the same, forearm",
    f"fingers miscounted, {SCENES:,} scenes",
)


def sensitivity_table() -> writer.Table:
    with pool.executor() as workers:
        usual, *others = workers.map(headlines, [{}, *(change for both in CHANGES.values() for change in both)])
    rows, left = [("as stated", *_stated(usual))], iter(others)
    for name, changes in CHANGES.items():
        cells = [_moved(next(left), usual) for _ in changes]
        rows.append((name, *(" / ".join(cell) for cell in zip(*cells, strict=True))))
    return writer.Table(HEAD, rows)


def _stated(one: Headlines) -> list[str]:
    newtons = (f"{force:.3g} N" for force in (one.rigid_n, one.forearm_n))
    return [f"{one.felt_n:.2g} N", f"{one.decided_ms:.3g} ms", *newtons, f"{100 * one.wrong.mean():.1f} %"]


def _moved(one: Headlines, usual: Headlines) -> list[str]:
    """Relative changes, and the difference of the shares with its 95 % interval, in points."""
    moved = [f"{100 * (now / before - 1):+.0f} %" for now, before in zip(one[:-1], usual[:-1], strict=True)]
    more = 100 * (one.wrong - usual.wrong)
    return [*moved, f"{more.mean():+.1f} ± {1.96 * more.std() / math.sqrt(len(more)):.1f}"]
