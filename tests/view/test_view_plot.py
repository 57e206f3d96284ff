"""What a plot is drawn from, against a computation frame by frame; and that it is drawn."""

import numpy as np
import pytest
from tracker_frames import frame, pressed

from contactfpga import Skin
from contactfpga.tools.view.plot import STEPS, Touches
from contactfpga.wire.protocol import Frame
from contactfpga.zones.zone import Zones

CELLS = Skin(report="cells")


class Recording:
    """Frames of a made-up board, by their times in s."""

    def __init__(self, frames, sheet=None, timed=True):
        self.title, self.sheet = "/somewhere/made-up.bin", sheet or Skin().sheet
        self._frames, self.timed = frames, timed

    @property
    def duration_s(self):
        return self._frames[-1][0]

    def frames(self, start_s=0.0, end_s=None):
        return ((seconds, zones) for seconds, zones in self._frames if start_s <= seconds <= (end_s or np.inf))


def recorded(count, places):
    """A frame per ms; ``places``: by the number of the frame."""
    made = []
    for number in range(count):
        zones = frame(1000 * number, places(number))
        zones.frame.__dict__["sequence"] = number % 256
        made.append((number / 1000, zones))
    return made


def test_where_and_for_how_long(monkeypatch):
    monkeypatch.setattr("contactfpga.tools.view.plot.CHUNK", 7)
    found = Touches.of(Recording(recorded(1001, lambda number: [(3, 4)] if number < 250 else [(9.4, 11), (1, 1)])))
    wanted = np.zeros((16, 16))
    wanted[4, 3], wanted[11, 9], wanted[1, 1] = 0.25, 0.75, 0.75
    np.testing.assert_allclose(found.touched_s, wanted, atol=1e-9)
    assert found.frames == 1001
    assert found.zones[: STEPS // 5].tolist() == [1] * (STEPS // 5)
    assert set(found.zones[STEPS // 2 :]) == {2}
    assert set(found.area_mm2[STEPS // 2 :]) == {1800.0}
    assert np.flatnonzero(found.rows[:, 0]).tolist() == [4]
    assert np.flatnonzero(found.rows[:, -1]).tolist() == [1, 11]
    assert found.lost.sum() == 0


@pytest.mark.parametrize("chunk", [3, 2000])
def test_a_piece_that_came_late_shows(monkeypatch, chunk):
    """The first piece has five frames, of which only the last one's moment is known."""
    monkeypatch.setattr("contactfpga.tools.view.plot.CHUNK", chunk)
    frames = [(max(0.0, seconds - 0.004), zones) for seconds, zones in recorded(50, lambda _: [])]
    frames[20:30] = [(seconds + 0.002, zones) for seconds, zones in frames[20:30]]
    late = np.array(Touches.of(Recording(frames)).late)
    assert late[:, 1].tolist() == pytest.approx([-0.004, -0.002, -0.004])
    np.testing.assert_allclose(late[:, 0], [0, 0.018, 0.026], atol=0.0011)


def test_a_barycenter_over_the_seam_lies_in_the_nearer_column():
    skin = Skin(rows=4, columns=12, surface="cylinder", radius_mm=40.0, closed=True)
    frames = []
    for number, sum_x in enumerate((3, 45, 47, 47)):  # columns 0.75, 11.25 and 11.75
        records = np.array([[4, sum_x, 8, 0]], np.int64)
        sent = Frame(number, 1000 * number, frozenset(), 0, 0, 1, 4, records, None)
        frames.append((number / 1000, Zones(sent, skin.sheet)))
    found = Touches.of(Recording(frames, skin.sheet))
    assert np.argwhere(found.touched_s).tolist() == [[2, 0], [2, 1], [2, 11]]


def test_one_short_touch_in_a_long_recording_shows():
    found = Touches.of(Recording(recorded(5000, lambda number: [(3, 4)] if number == 2345 else [])))
    assert np.flatnonzero(found.zones).tolist() == [int(2.345 / 4.999 * STEPS)]


def test_a_pause_counts_for_no_longer_than_a_keep_alive():
    before, after = recorded(2, lambda number: [(3, 4)])
    found = Touches.of(Recording([before, (60.0, after[1])]))
    assert found.touched_s.sum() == pytest.approx(0.25)


def test_gaps_of_the_sequence_are_losses_at_their_time():
    frames = recorded(1000, lambda number: [])
    kept = [one for number, one in enumerate(frames) if number not in (100, 101, 102, 900)]
    found = Touches.of(Recording(kept))
    steps = np.flatnonzero(found.lost)
    assert found.lost[steps].tolist() == [3, 1]
    assert found.seconds[steps] == pytest.approx([0.103, 0.901], abs=0.003)


def test_cells_count_by_themselves():
    """Frames of cells are not made by the host's own decoder here but put together by hand."""
    cells = np.zeros((16, 16), bool)
    cells[2, 3:6] = True
    made = []
    for number in range(101):
        zones = pressed(1000 * number, cells if number < 50 else ~cells & False, skin=CELLS)
        zones.frame.__dict__.update(bitmap=cells if number < 50 else np.zeros((16, 16), bool), moments=None)
        zones.frame.__dict__["sequence"] = number
        made.append((number / 1000, zones))
    found = Touches.of(Recording(made, CELLS.sheet))
    assert found.touched_s[2, 3:6] == pytest.approx([0.05] * 3)
    assert found.touched_s.sum() == pytest.approx(0.15)
    assert found.rows[2, 0] == 3


@pytest.mark.slow
@pytest.mark.parametrize("timed", [False, True])
def test_it_is_drawn_and_says_what_is_not_known(tmp_path, timed):
    plot = pytest.importorskip("contactfpga.tools.view.plot")
    frames = recorded(500, lambda number: [(number / 50, 5)])
    path = plot.draw(Recording(frames, timed=timed), tmp_path / "plot.svg")
    text = path.read_text()
    assert "made-up.bin: 16x16 cells, 500 frames in 0.5 s" in text
    assert ("the file has no delays" in text) == (not timed)


def test_the_command_draws_a_recording_and_refuses_what_is_none(tmp_path, capsys, monkeypatch):
    pytest.importorskip("amaranth")
    import contactfpga
    from contactfpga.tools import cli

    monkeypatch.chdir(tmp_path)
    with contactfpga.open("sim://?scene=palm", record="palm.bin") as board:
        for _ in range(20):
            board.next()
    assert cli.main(["plot", "palm.bin"]) == 0
    assert (tmp_path / "palm.png").read_bytes().startswith(b"\x89PNG")
    assert cli.main(["plot", "replay://palm.bin", "--output", "palm.gif"]) == 1
    assert cli.main(["plot", "none.bin"]) == 1
    errors = capsys.readouterr().err
    assert "must end in .png or .svg" in errors
    assert "none.bin cannot be opened" in errors
