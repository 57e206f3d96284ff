"""Recordings in the view: a file of bytes is played, led to any moment, paused, and counted."""

import pytest
from model_board import ModelBoard

import contactfpga
from contactfpga import Skin, terminal
from contactfpga.errors import ContactFPGAError
from contactfpga.tools import cli
from contactfpga.tools.view import opening
from contactfpga.tools.view.board_recording import load
from contactfpga.tools.view.playback import Player


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    pytest.importorskip("amaranth")
    path = tmp_path_factory.mktemp("view") / "moving.bin"
    with contactfpga.open("sim://?scene=moving", record=path) as board:
        while board.clock() < 0.5:
            board.next()
    return f"replay://{path}"


@pytest.fixture
def player(file, clock):
    return Player(load(file), clock=clock)


def test_it_plays_in_its_own_time(player):
    while player.position_s < 0.3:
        player.poll()
    moment = player.poll()
    assert moment.zones.time_us / 1e6 == pytest.approx(player.position_s, abs=0.002)
    assert player.meter.frames_per_s == pytest.approx(10_400, rel=0.02)
    began = player.position_s
    player.speed = 0.01
    for _ in range(10):
        player.poll()
    assert player.position_s - began == pytest.approx(10 * 0.02 * 0.01, rel=0.2)


def test_it_can_be_led_to_any_moment(player):
    player.poll()
    player.pause()
    for seconds in (0.4, 0.1, 0.11, -5.0):
        player.seek(seconds)
        moment = player.poll()
        assert player.position_s == max(0.0, seconds)
        assert moment.zones.time_us / 1e6 == pytest.approx(max(0.0, seconds), abs=0.001)
        assert player.poll() is None
    player.play()
    player.poll()
    assert player.position_s == pytest.approx(0.02, abs=0.001)


def test_at_its_end_it_stops_and_begins_again_when_asked(player):
    player.seek(1e9)
    moment = player.poll()
    assert player.position_s == player.duration_s
    assert moment.zones.time_us / 1e6 == pytest.approx(player.duration_s, abs=0.001)
    player.poll()
    assert not player.playing
    player.play()
    player.poll()
    assert player.position_s < 0.1


def test_a_contact_keeps_its_id_from_frame_to_frame(player):
    ids = {track.id for _ in range(10) if (moment := player.poll()) for track in moment.tracks.active}
    assert ids == {1}


@pytest.mark.parametrize(
    ("port", "link", "says"),
    [
        ("replay://none.bin", None, "cannot be opened"),
        ("replay://noise.bin", None, "holds no hello"),
        ("noise.bin", "arm", "holds one board; --link is for files of `contactfpga record`$"),
        ("replay://noise.bin?link=arm", None, "holds one board; --link is for files of `contactfpga record`$"),
        ("none.mcap", None, r"none\.mcap cannot be opened: No such file or directory; is the path right"),
    ],
)
def test_what_cannot_be_played_is_named(tmp_path, monkeypatch, port, link, says):
    pytest.importorskip("mcap")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "noise.bin").write_bytes(b"\x00\x01\x02" * 100)
    with pytest.raises(ContactFPGAError, match=says):
        opening._source(opening.ViewRequest(port, link=link))


def test_a_long_recording_says_how_far_it_is_read(tmp_path, monkeypatch, capsys):
    pytest.importorskip("matplotlib")
    monkeypatch.chdir(tmp_path)
    board = ModelBoard(Skin())
    data = board.hello() + b"".join(board.frame() for _ in range(500))
    (tmp_path / "long.rec").write_bytes(data)
    for soon_s, lines in ((60.0, 0), (0.0, 2)):
        monkeypatch.setattr(terminal, "SOON_S", soon_s)
        monkeypatch.setattr(terminal, "LINES_S", 0.0)
        assert cli.main(["plot", "long.rec"]) == 0
        said = capsys.readouterr().err.splitlines()
        assert len(said) >= lines
        assert bool(said) == bool(lines)
        assert all(one.startswith("Reading long.rec: 0 of 0 MB") for one in said)
