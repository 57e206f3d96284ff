"""A robot with a sheet on each of several links, as `robot.toml` has it."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from contactfpga.choices.choice import trusted
from contactfpga.driver.mcap_part import MAX_LINKS
from contactfpga.inputs import tomlfile
from contactfpga.inputs.values import shown
from contactfpga.robot.body import plan
from contactfpga.robot.body import urdf as urdf_file
from contactfpga.robot.body.answer import BodyError
from contactfpga.robot.body.joints import Joints
from contactfpga.robot.body.kinematics import Kinematics
from contactfpga.robot.body.plan import Plan

if TYPE_CHECKING:
    from contactfpga.robot.body.open_body import OpenBody

KEYS = ("urdf", "links")


@dataclasses.dataclass(frozen=True, eq=False)
class Body:
    """The links that have a sheet, and how they are connected."""

    links: dict[str, Plan]
    kinematics: Kinematics | None = None
    """How the links move; None without a URDF, and then there is no base frame."""
    urdf: Path | None = None
    """The file that says how the links are connected."""

    @classmethod
    def load(cls, path: str | Path, trust: bool = False) -> Body:
        """Read `robot.toml`; the paths in it count from its folder. ``trust`` as for :meth:`contactfpga.Skin.load`.
        Raises :class:`BodyError`, OSError."""
        path = Path(path)
        values = tomlfile.load(path, BodyError)
        try:
            with trusted(trust):
                return cls.of(values, path.parent)
        except BodyError as error:
            raise BodyError(f"{path}: {error}") from None

    @classmethod
    def of(cls, values: Mapping[str, Any], folder: Path) -> Body:
        """What such a file says; paths in it count from ``folder``. Raises :class:`BodyError`, OSError."""
        for key in values:
            if key not in KEYS:
                raise BodyError(f"unknown key {shown(key)}; known are {', '.join(KEYS)}")
        tables = values.get("links")
        if not isinstance(tables, list) or not tables:
            raise BodyError("there is no link; give a table [[links]] with name, skin and port for each")
        if len(tables) > MAX_LINKS:
            raise BodyError(f"{len(tables)} links; the limit is {MAX_LINKS}")
        urdf = urdf_file.located(plan.text(values, "urdf"), folder) if "urdf" in values else None
        kinematics = None if urdf is None else Kinematics(urdf_file.load(urdf))
        return cls(_by_name([plan.read(one, folder) for one in tables], kinematics), kinematics, urdf)

    def open(self, joints: Joints | None = None, *, timeout: float = 1.0, period_s: float = 0.002) -> OpenBody:
        """Open every link's board, each in its own thread, and return when each was tried once. A board that does not
        answer is tried again until it does.

        Args:
            joints: a function from a time on the host's clock to the joint angles then, for instance a
                :class:`JointHistory`; without it there are only contacts in the links' frames.
            timeout: seconds for a board's hello.
            period_s: how often at most a link's newest frame is taken.
        """
        from contactfpga.robot.body.open_body import OpenBody

        if joints is not None and not callable(joints):
            raise TypeError(f"joints is {shown(joints)}; it must be a function of a time, such as a JointHistory")
        return OpenBody(self, joints, timeout=timeout, period_s=period_s)


def _by_name(plans: list[Plan], kinematics: Kinematics | None) -> dict[str, Plan]:
    found: dict[str, Plan] = {}
    ports: dict[str, str] = {}
    for one in plans:
        if one.name in found:
            raise BodyError(f"two links are named {shown(one.name)}")
        if kinematics is not None and one.frame not in kinematics.robot.links:
            raise BodyError(f"link {shown(one.name)}: frame is {shown(one.frame)}; the URDF has no such link")
        if one.port is not None and not one.port.startswith("sim:"):
            if one.port in ports:
                both = f"{shown(ports[one.port])} and {shown(one.name)}"
                raise BodyError(f"links {both} have one port, {shown(one.port)}")
            ports[one.port] = one.name
        if one.folds is not None and kinematics is not None and one.folds.joint not in kinematics.joint_names:
            raise BodyError(f"link {shown(one.name)}: its folds are of joint {shown(one.folds.joint)}; there is none")
        found[one.name] = one
    return found
