"""A wrapper for reinforcement learning: what a sheet feels is part of the observation."""

import numpy as np

from contactfpga.mujoco import Sheets


class TactileEnvironment:
    """An environment whose observation ends with x and y in mm and area in cells of at most four zones, 0 for none.

    x is -1 where a zone goes all the way round a closed sheet. A board without fresh frames raises
    :class:`contactfpga.body.NoLinkData`, as no data is never no contact.
    """

    def __init__(self, model, data, robot="robot.toml", link="arm"):
        self.data, self.link = data, link
        self.sheets = Sheets(model, data, robot, golden=True)

    def reset(self):
        self.sheets.reset(key=0)  # the model's first keyframe, if it has one
        return self.observation()

    def step(self, action):
        self.data.ctrl[:] = action
        self.sheets.step()
        return self.observation()

    def observation(self):
        zones = [contact.zone for contact in self.sheets.snapshot().contacts("link", [self.link])]
        rows = np.zeros((4, 3))
        for row, zone in zip(rows, zones):
            row[:] = -1.0 if zone.x_mm is None else zone.x_mm, zone.y_mm, zone.area_cells
        return np.concatenate([self.data.qpos, self.data.qvel, rows.ravel()])
