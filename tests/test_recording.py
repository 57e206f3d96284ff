"""What `record=` writes, `replay://` reads."""

import pytest
from wire import Wire

import contactfpga

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
    assert [zones.to_dict() for zones in again] == [zones.to_dict() for zones in live]


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
