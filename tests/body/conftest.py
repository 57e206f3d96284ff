import time

import pytest
from two_links import ROBOT, write_robot

from contactfpga.robot.body import OpenBody


@pytest.fixture
def robot(tmp_path):
    return write_robot(tmp_path)


@pytest.fixture
def patient(robot):
    """The same; no link is late unless the test sets the clock forward."""
    robot.write_text(ROBOT.replace("[[links]]", "[[links]]\nlate_s = 60.0\nsilent_s = 90.0"))
    return robot


@pytest.fixture
def leap(monkeypatch):
    """``leap(seconds)`` sets the clock of bodies forward."""
    passed_s = []
    monkeypatch.setattr(OpenBody, "clock", staticmethod(lambda: time.monotonic() + sum(passed_s)))
    return passed_s.append
