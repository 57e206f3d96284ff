"""The host's clock at the moment of a sample, over simulated ways that delay frames."""

import dataclasses

import numpy as np
import pytest
from model_board import SCAN_US, ModelBoard
from study_pages import section

import contactfpga
from contactfpga.driver.clock import PIECE_S, ClockFit
from contactfpga.driver.conversation import Conversation, frames_in
from contactfpga.zones.batch import Batch
from contactfpga.zones.run import Run
from contactfpga_sim.lab.clock import tables
from contactfpga_sim.lab.clock.tables import PATHS, accuracy, followed, moments

SKIN = contactfpga.Skin()
QUIET = dataclasses.replace(PATHS["usb_125us"], rate_hz=200.0)


@pytest.mark.parametrize("name", PATHS)
def test_the_fit_is_far_nearer_than_arrivals_and_states_its_uncertainty(name):
    path = dataclasses.replace(PATHS[name], rate_hz=min(PATHS[name].rate_hz, 100.0))
    found = accuracy(path, seeds=4, seconds=40.0)
    assert found.error_s < 0.75 * found.late_s
    assert found.within >= 0.9
    assert found.sigma_s < max(found.late_s, 4 * found.error_s), "not by stating more than anyone believes"


def test_the_page_holds_what_a_run_shows():
    (row,) = [
        line for line in section("clock.md", "accuracy").splitlines() if line.startswith(f"| {PATHS['slow'].title} |")
    ]
    assert row in tables.accuracy_table(("slow",))


def test_no_sample_is_said_to_come_after_its_arrival():
    for name in ("usb_1ms", "busy", "net"):
        frames = followed(moments(dataclasses.replace(PATHS[name], rate_hz=100.0), 60.0, 3, 20.0))
        assert (frames.found_s <= frames.arrived_s).all(), name


@pytest.mark.parametrize("ppm", [-80.0, 0.0, 35.0, 80.0])
def test_the_drift_of_the_clocks_is_found(ppm):
    fit = ClockFit()
    followed(moments(QUIET, ppm, 1, 40.0), fit)
    assert (fit.line(9e9).rate - 1) * 1e6 == pytest.approx(ppm, abs=4)


def test_a_clock_that_no_crystal_has_is_not_believed():
    fit = ClockFit()
    for step in range(2000):
        fit.arrived(step * 10_000, step * 0.0101, 0.0)  # off by one percent
    assert abs(fit.line(9e9).rate - 1) <= 200e-6


def test_a_clock_that_no_crystal_has_costs_no_more_than_one_that_a_crystal_has():
    """The fit keeps no more pieces of a clock that is 2.4 % fast, though each of 1,000 frames per second comes earlier
    than its bounds allow."""
    fit = ClockFit()
    for step in range(10_000):
        fit.arrived(step * 1024, step * 0.001, 0.0)
    assert len(fit._pieces) <= 10.24 / PIECE_S + 2


def shifted(frames, after_s, host_s):
    """Arrivals of frames when the host's clock steps."""
    begun = None
    for moment in frames:
        begun = moment.sampled_s if begun is None else begun
        step = host_s if moment.sampled_s - begun > after_s else 0.0
        asked = None if moment.asked_s is None else moment.asked_s + step
        yield moment._replace(arrived_s=moment.arrived_s + step, sampled_s=moment.sampled_s + step, asked_s=asked)


@pytest.mark.parametrize("step_s", [-3600.0, -2.0, -0.05, 0.05, 2.0, 3600.0])
def test_after_a_step_of_the_host_clock_times_are_right_again(step_s):
    """Asleep, a host's clock stands while the board's goes on: a step back. Requests show the other."""
    frames = followed(shifted(moments(QUIET, 30.0, 2, 30.0), 10.0, step_s))
    late = frames.sampled_s > frames.sampled_s[-1] - 15
    assert np.abs(frames.errors_s[late]).max() < 0.001


def test_a_way_that_is_jammed_for_seconds_moves_nothing():
    path = dataclasses.replace(QUIET, asked_s=1e9)
    jammed = (
        moment._replace(arrived_s=moment.arrived_s + (0.5 if 3000 < index < 4000 else 0.0))
        for index, moment in enumerate(moments(path, 10.0, 4, 30.0))
    )
    frames = followed(jammed)
    errors = np.abs(frames.errors_s[1000:])
    assert errors.max() < 0.001
    assert (frames.arrived_s - frames.sampled_s)[3500] > 0.5


def test_a_pile_that_waited_before_the_port_was_read_is_forgotten():
    fit = ClockFit()
    for step in range(300):  # 3 s of frames, all at once
        fit.arrived(step * 10_000, 100.0, 0.0)
    for step in range(300, 400):
        fit.arrived(step * 10_000, 97.0 + step * 0.01 + 0.0002, 0.0)
    fit.answered(399 * 10_000, 97.0 + 3.99 - 0.0001)
    line = fit.line(9e9)
    assert line.at(3_990_000) == pytest.approx(100.99, abs=0.0003)
    assert line.sigma_s < 0.0003


# ---- in the driver


class Line:
    """A board with an exact clock and a host 1,000 s ahead; bytes take ``late_s``."""

    def __init__(self, late_s=0.001, live=True):
        self.board, self.host = ModelBoard(SKIN), Conversation("x", live=live)
        self.late_s, self.begun_s = late_s, 1000.0

    def send(self, data):
        now = self.begun_s + self.board.time_us / 1e6 + self.late_s
        found = [event for event in self.host.receive(data, now) if isinstance(event, Run)]
        for _, hello in self.board.hear(self.host.data_to_send()):
            self.board.time_us += round(self.late_s * 1e6)
            found += self.send((self.board.hello() if hello else b"") + self.board.frame())
        return found

    def ask(self):
        now = self.begun_s + self.board.time_us / 1e6
        self.host.ask(now, now + 1)
        return self.send(b"")


def test_a_board_that_is_asked_has_times_with_a_small_uncertainty():
    line = Line()
    line.ask()
    for _ in range(5000):
        ((zones,),) = line.send(line.board.frame())
    truth = 1000.0 + zones.time_us / 1e6
    assert abs(zones.host_time_s - truth) < 0.001
    assert zones.host_sigma_s < 0.0005
    assert zones.arrived_s == pytest.approx(truth + line.late_s, abs=2 * SCAN_US / 1e6)


def test_a_restart_of_the_board_begins_anew():
    line = Line()
    line.ask()
    for _ in range(3000):
        line.send(line.board.frame())
    line.begun_s += line.board.time_us / 1e6 + 0.3
    line.board.power_up()
    line.send(line.board.hello())
    ((zones,),) = line.send(line.board.frame())
    assert line.host.stats.restarts == 1
    assert zones.host_time_s == pytest.approx(line.begun_s + zones.time_us / 1e6, abs=0.002)


def test_runs_and_batches_carry_the_same_times():
    line = Line()
    line.ask()
    line.send(b"".join(line.board.frame() for _ in range(50)))
    found = line.send(b"".join(line.board.frame() for _ in range(200)))
    assert len(found) == 1
    batch = Batch.of(found)
    single = frames_in(found)
    for name in ("host_time_s", "host_sigma_s", "arrived_s"):
        assert batch.frames[name].tolist() == [getattr(zones, name) for zones in single], name
    assert np.allclose(np.diff(batch.frames["host_time_s"]), SCAN_US / 1e6, atol=1e-6)


def test_the_simulated_board_is_on_its_own_clock():
    with contactfpga.open("sim://") as board:
        for _ in range(300):
            zones = board.next()
    assert zones.host_time_s == pytest.approx(zones.time_us / 1e6, abs=3 * zones.host_sigma_s)
    assert zones.host_sigma_s < 0.001
    assert zones.host_time_s <= zones.arrived_s
