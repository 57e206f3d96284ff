import pytest
from two_links import ROBOT, write_robot


@pytest.fixture
def robot(tmp_path):
    return write_robot(tmp_path)


@pytest.fixture
def patient(robot):
    """The same, for threads of which a busy machine lets each wait for seconds."""
    robot.write_text(ROBOT.replace("[[links]]", "[[links]]\nlate_s = 4.0\nsilent_s = 5.0"))
    return robot
