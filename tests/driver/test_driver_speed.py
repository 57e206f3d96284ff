"""What `python -m contactfpga_sim.lab.speed.driver` feeds the driver is what a board sends."""

from contactfpga.driver.conversation import Arrival, Conversation
from contactfpga_sim.lab.speed.driver import FRAMES, SKIN, STEP_US, frame, greeting


def test_its_frames_arrive_and_go_on_where_they_begin_again():
    host = Conversation("x", SKIN)
    host.receive(greeting(5), 0.0)
    assert host.hello.heard == 5
    numbers = [*range(300), *range(301, FRAMES, 4000), FRAMES - 2, FRAMES - 1, 0, 1]
    events = host.receive(b"".join(frame(number, 1) for number in numbers), 0.0)
    found = [event.zones.time_us // STEP_US for event in events if isinstance(event, Arrival)]
    assert found == [*numbers[:-2], FRAMES, FRAMES + 1]
    assert not host.stats.damaged
