import pytest
from two_links import ROBOT, write_robot


@pytest.fixture
def robot(tmp_path):
    return write_robot(tmp_path)


@pytest.fixture
def patient(robot):
    """The same, for threads on a machine that is busy."""
    robot.write_text(ROBOT.replace("[[links]]", "[[links]]\nlate_s = 1.0\nsilent_s = 1.5"))
    return robot
