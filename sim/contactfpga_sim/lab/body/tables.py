"""The tables and pictures of docs/body.md."""

from __future__ import annotations

import itertools
import math
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from contactfpga import examples
from contactfpga import picture_style as style
from contactfpga.driver.address import Sim
from contactfpga.robot.body import Body, LinkState
from contactfpga.robot.body.kinematics import Pose
from contactfpga.robot.body.plan import Plan
from contactfpga.robot.body.snapshot import on_link
from contactfpga_sim.lab import writer
from contactfpga_sim.lab.body import folding, outages, registering
from contactfpga_sim.model.scenes.scene import scene

POINTS = (3, 4, 6, 10)
SWEEPS = (1, 2, 5, 10)


def outages_table() -> str:
    """What becomes of a link."""
    rows = [("fault", "states of the link", "reported after, s", "ok again after, s")]
    with tempfile.TemporaryDirectory() as folder:
        for outage in outages.OUTAGES:
            seen = outages.play(outage, Path(folder))
            states = ", ".join(f"`{one}`" for one in seen.statuses)
            rows.append((outage.name, states, _seconds(seen.noticed_s), _seconds(seen.back_s)))
    return writer.table_of(rows)


def _seconds(value: float) -> str:
    return "at once" if value < 0.0005 else f"{value:.3f}"


def registration_table() -> str:
    """How well a sheet is found."""
    head = ("sheet", "points", "refused, %", "wrongly mirrored, %", "middle off by, mm", "turned by, degrees")
    rows: list[tuple[str, ...]] = [(*head, "residual, mm")]
    with tempfile.TemporaryDirectory() as folder:
        for name, skin in registering.SKINS.items():
            for normals, points in itertools.product((True, False), POINTS):
                if skin.radius_mm is None and not normals:  # in a plane they have to be known
                    continue
                found = registering.study(skin, points, Path(folder), normals=normals)
                first = f"{name}, {'with' if normals else 'without'} normals" if points == POINTS[0] else ""
                shares = (f"{100 * found.refused:.0f}", f"{100 * found.wrong:.0f}")
                values = (found.middle_mm, found.turned_deg, found.residual_mm)
                errors = ("" if math.isnan(value) else f"{value:.2f}" for value in values)
                rows.append((first, str(points), *shares, *errors))
    return writer.table_of(rows)


def folds_table() -> str:
    """How many zones are marked."""
    head = ("times over the range", "folds, %", "touches apart from the fold, %", "touches joined with it, %")
    rows: list[tuple[str, ...]] = [(*head, "touches within it, %", "touches, joint straight, %")]
    return writer.table_of([*rows, *map(_folds, SWEEPS)])


def folds_sample() -> str:
    """The first row of :func:`folds_table`."""
    return writer.line(_folds(SWEEPS[0]))


def _folds(sweeps: int) -> tuple[str, ...]:
    found = folding.rates(sweeps, count=1500)
    values = (found.folds, found.apart, found.joined, found.within, found.straight)
    return (str(sweeps), *(f"{100 * value:.1f}" for value in values))


def draw(folder: Path) -> Path:
    """The example's robot from the front and from the side, with its sheets and contacts."""
    import matplotlib

    body = Body.load(examples() / "robot.toml")
    kinematics = body.kinematics
    assert kinematics is not None
    angles = dict.fromkeys(kinematics.joint_names, 0.0) | {"L_ELBOW_P": -0.8}
    with matplotlib.rc_context(style.SETTINGS):
        figure = style.new(4.6)
        for axes, (across, title) in zip(
            figure.subplots(1, 2, sharey=True), ((1, "from the front"), (0, "from the right"))
        ):
            for joint in kinematics.robot.joints.values():
                ends = [kinematics.pose(link, angles).point_m for link in (joint.parent, joint.child)]
                axes.plot([end[across] for end in ends], [end[2] for end in ends], color=style.SOFT, lw=2)
            for plan in body.links.values():
                _draw_sheet(axes, plan, kinematics.pose(plan.frame, angles), across)
            axes.set(title=title, aspect="equal", xlabel=f"{'xy'[across]}, m", ylim=(-0.85, 0.85), xlim=(-0.6, 0.6))
            axes.grid(True)
        figure.axes[0].set_ylabel("z, m")
        handles, names = figure.axes[0].get_legend_handles_labels()
        kept = dict(zip(names, handles))
        figure.legend(kept.values(), kept.keys(), loc="outside lower center", ncols=3)
        return style.save(figure, folder / "body.svg")


def _draw_sheet(axes: Any, plan: Plan, pose: Pose, across: int) -> None:
    skin = plan.skin
    x, y = np.meshgrid(np.arange(skin.columns) * skin.pitch_x_mm, np.arange(skin.rows) * skin.pitch_y_mm)
    cells = np.array([pose.apply(np.array(plan.place(*place)[0])) for place in zip(x.ravel(), y.ravel())])
    axes.plot(cells[:, across], cells[:, 2], ".", ms=1.2, color=style.SKY)
    axes.plot([], [], "s", ms=5, color=style.SKY, label="cells of the sheets")
    asked = Sim.parse(plan.port or "sim://").scene
    zones = folding.frame_of(scene(skin, asked)(0.0), skin.replace(report="cells"))
    for one in on_link(plan, LinkState(zones, 0.0, "ok", "", 0.0)):
        contact = one.moved(pose, "base")
        assert contact.point_m is not None
        assert contact.normal is not None
        tip = np.array(contact.point_m) + 0.12 * np.array(contact.normal)
        ends = ([contact.point_m[across], tip[across]], [contact.point_m[2], tip[2]])
        axes.plot(ends[0][0], ends[1][0], "o", ms=5, color=style.VERMILLION, label="contacts")
        axes.plot(*ends, color=style.VERMILLION, lw=1.5, label="their normals")
