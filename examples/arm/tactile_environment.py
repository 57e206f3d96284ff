"""A wrapper for reinforcement learning: what a sheet feels is part of the observation."""

import numpy as np

from contactfpga.mujoco import Sheets


class TactileEnvironment:
    """An environment whose observation ends with the places and sizes of at most four zones."""

    def __init__(self, model, data, robot="robot.toml", link="arm"):
        self.data, self.link = data, link
        self.sheets = Sheets(model, data, robot, golden=True)

    def reset(self):
        self.sheets.reset()
        return self.observation()

    def step(self, action):
        self.data.ctrl[:] = action
        self.sheets.step()
        return self.observation()

    def observation(self):
        zones = self.sheets.snapshot().links[self.link].zones or ()
        rows = np.zeros((4, 3))
        for row, zone in zip(rows, zones):
            row[:] = zone.x_mm, zone.y_mm, zone.area_cells
        return np.concatenate([self.data.qpos, self.data.qvel, rows.ravel()])
