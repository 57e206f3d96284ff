"""Balls on rails that press a link's sheet at stated places with stated forces, in MuJoCo."""

import mujoco
import numpy as np

from contactfpga.mujoco import wear
from contactfpga.robot.body import Body

BALL_M = 0.01
TILES = """
[cover]
model = "foam"
thickness_m = 0.003
[cover.cap]
side_m = {side}
[cover.switch]
force_n = 0.3
hysteresis = 0.1
"""
"""Caps that take all of the foam's force."""
LINK = '[[links]]\nname = "link"\nskin = "skin.toml"\n'


def robot(folder, skin="", link="", side=0.0098):
    """robot.toml of one link, in a folder; ``skin`` and ``link``: more lines of the Skin's and of the link's table."""
    (folder / "skin.toml").write_text(skin + TILES.format(side=side))
    (folder / "robot.toml").write_text(LINK + link)
    return folder / "robot.toml"


def pressed(robot_toml, touches, worn=True, timestep=5e-4, size_m=BALL_M):
    """Model and data of a robot that stands still, and of balls that press with forces in N at (x, y) in mm of links:
    ``touches`` are (link, x, y, force)."""
    spec = mujoco.MjSpec()
    spec.option.timestep, spec.option.gravity = timestep, [0, 0, 0]
    plans = Body.load(robot_toml).links
    for plan in plans.values():
        spec.worldbody.add_body(name=plan.frame)
    if worn:
        wear(spec, robot_toml)
    return compiled(spec, plans, touches, size_m)


def compiled(spec, plans, touches, size_m=BALL_M, pose=lambda plan: (np.zeros(3), np.eye(3))):
    """The same of any robot, whose links lie at ``pose``, a position and a rotation in the world."""
    for number, (link, x, y, _) in enumerate(touches):
        position, rotation = pose(plans[link])
        point, normal = (np.array(each) for each in plans[link].place(x, y))
        point, normal = position + rotation @ point, rotation @ normal
        body = spec.worldbody.add_body(name=f"ball {number}", pos=point + (size_m + 2e-4) * normal)
        mujoco.mju_quatZ2Vec(body.quat, -normal)
        body.add_joint(name=f"rail {number}", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, 0, 1], damping=[2, 0, 0])
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[size_m, 0, 0], mass=0.02, contype=2, conaffinity=1)
        motor = spec.add_actuator(name=f"push {number}", target=f"rail {number}", trntype=mujoco.mjtTrn.mjTRN_JOINT)
        motor.set_to_motor()
    model = spec.compile()
    data = mujoco.MjData(model)
    data.ctrl[:] = [force for *_, force in touches]
    return model, data


def random_touches(rng, count, link="link", pitch_x_mm=10.0):
    """Pushes of 2 to 8 N, at least 40 mm apart, a pitch from the edges of a sheet of 16x16 cells 10 mm high."""
    found = []
    while len(found) < count:
        x, y = rng.uniform(10, 140, 2)
        x *= pitch_x_mm / 10
        if all(np.hypot(x - other[1], y - other[2]) > 40 for other in found):
            found.append((link, float(x), float(y), float(rng.uniform(2, 8))))
    return found
