"""`replay://` reads what `record=` writes."""

import errno
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
from model_board import SCAN_US, ModelBoard
from wire import Wire

import contactfpga
from contactfpga.driver.recording import FileTap, RecordingTransport
from contactfpga.tools import cli

pytestmark = pytest.mark.usefixtures("_closed_ports")

SKIN = contactfpga.Skin()
LONG = 60.0  # s; what has to come comes at once, but for a machine that is busy


def test_recording_replays_the_same_frames(board, tmp_path):
    file = tmp_path / "frames.bin"
    with contactfpga.open(board.path, record=file, timeout=LONG) as opened:
        board.send(b"".join(board.frame() for _ in range(40)))
        live = [opened.next(LONG) for _ in range(41)]
    with contactfpga.open(f"replay://{file}") as replay:
        again = list(replay)
        assert replay.stats.lost == 0
    # The first one came before it was known what was on the way when the port was opened.
    unknown = dict.fromkeys(("arrived_s", "host_time_s", "host_sigma_s"))
    assert [zones.to_dict() for zones in again[1:]] == [zones.to_dict() | unknown for zones in live]


@pytest.mark.parametrize("pace", [1, 2.5])
def test_a_recording_plays_in_its_own_time_where_that_is_asked_for(tmp_path, pace):
    file = tmp_path / "frames.bin"
    model = ModelBoard(SKIN)
    stream = model.hello()
    for _ in range(5):
        stream += model.frame()
        model.time_us += 100_000
    file.write_bytes(stream)
    started = time.monotonic()
    with contactfpga.open(f"replay://{file}?pace={pace}") as replay:
        after = [(time.monotonic() - started, zones.time_us) for zones in replay]
    assert [time_us for _, time_us in after] == [SCAN_US + index * (100_000 + SCAN_US) for index in range(5)]
    for index, (seconds, _) in enumerate(after):
        assert 0.1 * index / pace <= seconds < 0.1 * index / pace + LONG


@pytest.mark.parametrize("pace", ["0", "-1", "fast", "nan", "inf"])
def test_a_pace_that_cannot_be(tmp_path, pace):
    with pytest.raises(contactfpga.AddressError, match="must be a positive number"):
        contactfpga.open(f"replay://{tmp_path}/frames.bin?pace={pace}")


def test_read_zones_of_a_recording_gives_frame_by_frame(board, tmp_path):
    file = tmp_path / "frames.bin"
    file.write_bytes(board.hello() + board.frame() + board.frame())
    port = f"replay://{file}"
    assert [contactfpga.read_zones(port).sequence for _ in range(2)] == [0, 1]
    with pytest.raises(contactfpga.ReplayEnded, match="ends here"):
        contactfpga.read_zones(port)


def test_recording_without_a_hello(tmp_path):
    file = tmp_path / "frames.bin"
    file.write_bytes(Wire(SKIN).zones([]))
    with pytest.raises(contactfpga.ContactFPGAError, match="holds no hello"):
        contactfpga.open(f"replay://{file}")


def test_recording_of_another_skin(tmp_path):
    file = tmp_path / "frames.bin"
    file.write_bytes(Wire(SKIN).hello())
    with pytest.raises(contactfpga.SkinMismatch):
        contactfpga.open(f"replay://{file}", skin=SKIN.replace(rows=8))


def test_recording_that_does_not_exist():
    with pytest.raises(contactfpga.PortNotFound, match=r"replay:///no/such\.bin cannot be opened"):
        contactfpga.open("replay:///no/such.bin")


def test_doctor_of_a_recording_says_where_it_ends(tmp_path, capsys):
    """`doctor` of a recording names its end; it once printed that all was well and ended with status 1."""
    file, model = tmp_path / "frames.bin", ModelBoard(SKIN)
    file.write_bytes(model.hello() + b"".join(model.frame() for _ in range(30)))
    assert cli.main(["doctor", f"replay://{file}"]) == 0
    out = capsys.readouterr().out
    assert "note  the recording ends here" in out
    assert "ok    30 frames, 1 hellos" in out
    file.write_bytes(model.hello())
    assert cli.main(["doctor", f"replay://{file}"]) == 1
    assert "holds no frame" in capsys.readouterr().out


def test_a_port_is_given_back_though_its_recording_cannot_be_closed():
    class Full:
        def take(self, data, clock_s):
            pass

        def close(self):
            raise OSError(errno.ENOSPC, "No space left on device")

    closed = []
    port = SimpleNamespace(name="a", live=True, threaded=True, write=None, clock=None, close=lambda: closed.append(1))
    with pytest.raises(OSError, match="No space"):
        RecordingTransport(port, Full()).close()
    assert closed


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
def test_a_full_disk_is_named():
    says = r"^/dev/full cannot be written: No space left on device; make room, then record again$"
    tap = FileTap("/dev/full")
    with pytest.raises(contactfpga.ContactFPGAError, match=says):
        tap.take(bytes(1 << 20), 0.0)
    tap.close()
    tap = FileTap("/dev/full")
    tap.take(b"what waits", 0.0)
    with pytest.raises(contactfpga.ContactFPGAError, match=says):
        tap.close()
    tap.close()
