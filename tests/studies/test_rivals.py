"""Models of other ways to read a sheet: against closed forms, the golden model, and bounds of their times."""

import dataclasses
import math

import numpy as np
import pytest

from contactfpga.skin import Skin
from contactfpga_sim.lab.chart import errors, limits, rivals, speed
from contactfpga_sim.lab.chart.rivals import RIVALS
from contactfpga_sim.lab.covers import tiled
from contactfpga_sim.model.scenes import contacts
from contactfpga_sim.model.scenes.contacts import Contact
from contactfpga_sim.model.scenes.families import placements, touches
from contactfpga_sim.model.scenes.scene import Scene

SKIN = Skin(connectivity=4)
TILES = tiled(10.0)
ARRAY = RIVALS["analog array, 1 kHz"]
CELLS = RIVALS["OpenCV, cells from the board"]


def press(force_n, x_mm=52.0, y_mm=71.0, radius_mm=0.5):
    return Scene((Contact(shape=contacts.disc(radius_mm), x_mm=x_mm, y_mm=y_mm, force_n=force_n),))


@pytest.fixture
def ideal(monkeypatch):
    """Elements without noise, crosstalk and spread."""
    for name in ("NOISE_COUNTS", "CROSSTALK", "GAIN_SPREAD"):
        monkeypatch.setattr(rivals, name, 0.0)
    rivals._gains.cache_clear()
    yield
    rivals._gains.cache_clear()


def readings(scene):
    return rivals.analog(scene, scene.settled_s, SKIN, TILES, np.random.default_rng(1))


def test_an_element_reads_the_force_on_it_up_to_its_greatest(ideal):
    for force in (0.5, 3.1, 9.0):
        found = readings(press(force))
        assert found[7, 5] == round(force / 10 * 255)
        assert (found > 0).sum() == 1
    assert readings(press(25.0))[7, 5] == 255
    assert not readings(press(0.39)).any()


def test_all_elements_together_read_the_whole_force(ideal):
    # Spread over some 25 elements, each of which rounds.
    found = readings(press(60.0, radius_mm=25.0))
    assert found.sum() / 255 * 10 == pytest.approx(60.0, abs=1.5)
    (blob,) = rivals._blobs(found, SKIN)
    assert (blob.x_mm, blob.y_mm) == pytest.approx((52.0, 71.0), abs=0.3)


def test_neighbors_read_the_share_that_crosstalk_is(ideal, monkeypatch):
    monkeypatch.setattr(rivals, "CROSSTALK", 0.1)
    found = readings(press(8.0))
    assert found[7, 5] == 204
    assert [found[6, 5], found[8, 5], found[7, 4], found[7, 6]] == [20] * 4
    assert (found > 0).sum() == 5


def test_readings_are_as_noisy_as_stated():
    found = [rivals.analog(press(5.0), 0.0, SKIN, TILES, np.random.default_rng(seed))[7, 5] for seed in range(400)]
    assert np.std(found) == pytest.approx(math.hypot(rivals.NOISE_COUNTS, 12**-0.5), rel=0.15)


def test_matrix_rivals_find_the_connected_pieces():
    for scene in placements("fingers", 10, 2, SKIN):
        want = [dataclasses.astuple(one) for one in errors.exact_zones(scene.pressed(0.0, SKIN, TILES), SKIN)]
        for name in ("microcontroller, UART", "microcontroller, USB", "OpenCV, cells from the board"):
            got = [dataclasses.astuple(one) for one in RIVALS[name].zones(scene, SKIN, TILES)]
            np.testing.assert_allclose(sorted(got), sorted(want))


def test_force_places_better_than_switches_do():
    scenes = placements("fingers", 40, 3, SKIN)
    far = [np.nanmean([rival.errors(scene, SKIN, TILES).barycenter_mm for scene in scenes]) for rival in (ARRAY, CELLS)]
    assert far[0] < 0.6 * far[1]


def test_the_time_of_cells_is_that_of_the_golden_model():
    scene = touches("bumper", 1, 4, SKIN)[0]
    board = SKIN.replace(report="cells")
    cells = scene.pressed(scene.settled_s, SKIN)
    want = [speed.touch(board, cells, share)[0] / 12 for share in (np.arange(24) + 0.5) / 24]
    rng = np.random.default_rng(5)
    got = [CELLS.time_us(scene, SKIN, None, rng) for _ in range(400)]
    # The golden model waits for a frame with all cells; the rival for one with any.
    assert np.mean(want) - 96 < np.mean(got) < np.mean(want) + 10
    assert rivals.frame_bytes(board, 16) == speed.touch(board, cells, 0.3)[1]


@pytest.mark.parametrize("name", RIVALS)
def test_a_touch_is_reported_after_it_is_felt_and_within_the_rounds_that_takes(name, ideal):
    rival, pace = RIVALS[name], RIVALS[name].pace(SKIN)
    rng = np.random.default_rng(6)
    for scene in touches("fingers", 4, 7, SKIN):
        felt = next(
            at for at in np.linspace(0, scene.settled_s, 800) if rival.readings(scene, at, SKIN, TILES, rng).any()
        )
        for _ in range(3):
            late = rival.time_us(scene, SKIN, TILES, rng) - felt * 1e6
            least = pace.work_us + pace.wire_us - scene.settled_s * 1e6 / 799
            assert least < late
            # Half a strip more, as its rows are looked at in the middle of their time.
            assert late < 2.2 * pace.loop_us + pace.work_us + 2 * pace.wire_us + pace.slot_us


def test_a_touch_that_is_not_felt_is_never_reported():
    for rival in RIVALS.values():
        assert rival.time_us(press(0.05).approaching(100.0), SKIN, TILES, np.random.default_rng(8)) == math.inf


def test_a_wire_that_is_slower_than_the_frames_sets_their_rate():
    fast, slow = (ARRAY.pace(SKIN.replace(baud=baud)) for baud in (3_000_000, 750_000))
    assert fast.loop_us == 1000
    assert slow.loop_us == slow.wire_us == pytest.approx(260 * 10 / 0.75)


def test_lines_of_the_tables_have_all_columns():
    for name in RIVALS:
        cells = limits.rival_row(name, 12)
        assert len(cells) == 8
        assert "nan" not in " ".join(cells[:7])
        assert len(cells[7].split()) > 10  # what the model assumes
    found = limits.measured("finger", 10.0, 60)
    assert limits._floor_line("finger", 10.0, found).count(" | ") == 6
