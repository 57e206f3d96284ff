"""Several boards in one file: those of a robot."""

import numpy as np
import pytest
from fake_board import FakeBoard, wait_until
from mcap.reader import make_reader
from model_board import ModelBoard
from recorded_stream import NAMES, StreamPort, recorded, recorded_both, rewritten, written
from rosbags.highlevel import AnyReader

import contactfpga
from contactfpga import Skin
from contactfpga.recordings import Recording, Session
from contactfpga.robot.body import Body
from contactfpga.tools import cli
from contactfpga.tools.recordings import link_recorder
from contactfpga.tools.recordings.recover import recover
from contactfpga.wire.hello import Cutter

SKIN = Skin()
LONG = 60.0


def test_each_link_is_there_to_the_byte(tmp_path):
    ports, _ = recorded_both(tmp_path / "x.mcap")
    recording = Recording(tmp_path / "x.mcap")
    assert list(recording.links) == list(NAMES)
    assert [recording.links[name].sheet.rows for name in NAMES] == [16, 8]
    for name, port in zip(NAMES, ports):
        assert b"".join(data for _, data in recording.raw_bytes(name)) == port.sent
        alone = [zones.to_dict() for _, _, zones in recording.frames(link=name)]
        with contactfpga.open(f"replay://{tmp_path / 'x.mcap'}?link={name.replace(' ', '%20')}") as board:
            assert [zones.to_dict() for zones in board] == alone
        both = [zones.to_dict() for _, link, zones in recording.frames() if link == name]
        assert both == alone
    times = [t_s for t_s, _, _ in recording.frames()]
    assert times == sorted(times)


def test_a_link_must_be_named_where_there_are_several(tmp_path):
    recorded_both(tmp_path / "x.mcap", bytes_only=True)
    with pytest.raises(contactfpga.ContactFPGAError, match="several links; name one of them: left arm, chest"):
        contactfpga.open(f"replay://{tmp_path / 'x.mcap'}")
    with pytest.raises(contactfpga.ContactFPGAError, match="has no link 'leg'; it has left arm, chest"):
        contactfpga.open(f"replay://{tmp_path / 'x.mcap'}?link=leg")


@pytest.mark.parametrize("before", [b"", b"\0", b"frame\0", b"frame\0\0"])
@pytest.mark.parametrize("size", [1, 7, 1000])
def test_a_stream_is_cut_before_the_delimiter_of_its_hello(before, size):
    hello = ModelBoard(SKIN).hello()
    data = before + hello + b"frame\0\0"
    cutter, kept = Cutter(), b""
    for at in range(0, len(data), size):
        first, after = cutter.take(data[at : at + size])
        kept += first
        if after:
            break
    assert after
    assert kept + after == data[: len(kept + after)]
    assert kept.strip(b"\0") == before.strip(b"\0")
    assert size < 1000 or after.startswith(b"\0")
    assert after.lstrip(b"\0").startswith(hello.strip(b"\0"))


def test_a_link_without_a_hello_is_left_out(tmp_path):
    arm = ModelBoard(SKIN).hello() + ModelBoard(SKIN).frame()
    written(tmp_path / "x.mcap", {"arm": arm, "leg": b"\0\0noise\0"})
    recording = Recording(tmp_path / "x.mcap")
    assert list(recording.links) == ["arm"]
    assert [link for _, link, _ in recording.frames()] == ["arm"]
    assert [data for _, data in recording.raw_bytes("leg")] == [b"\0\0noise\0"]


def test_links_are_in_the_order_in_which_they_were_added(tmp_path):
    """And not in that in which their boards spoke."""
    data = ModelBoard(SKIN).hello() + ModelBoard(SKIN).frame()
    written(tmp_path / "x.mcap", dict.fromkeys(("chest", "arm", "leg"), data), ("arm", "leg", "chest"))
    assert list(Recording(tmp_path / "x.mcap").links) == ["arm", "leg", "chest"]


@pytest.mark.parametrize(
    "names",
    [("左腕", "右腕", "__"), ("arm 1", "arm-1", "arm_1_2", "arm_1"), ("1", "_1", "", "_")],
)
@pytest.mark.parametrize("bytes_only", [True, False])
def test_links_whose_names_become_one_topic_are_apart(tmp_path, names, bytes_only):
    ports = [StreamPort(frames=50 + 10 * number) for number in range(len(names))]
    with Session(tmp_path / "x.mcap", bytes_only=bytes_only) as session:
        for name, port in zip(names, ports):
            session.add(port, name=name)
        session.start()
        wait_until(lambda: session.wait(0.005) or not any(port.left for port in ports))
    found = recover(tmp_path / "x.mcap")
    for file in (tmp_path / "x.mcap", found.path):
        recording = Recording(file)
        assert list(recording.links) == list(names)
        for name, port in zip(names, ports):
            assert b"".join(data for _, data in recording.raw_bytes(name)) == port.sent
    with open(tmp_path / "x.mcap", "rb") as file:
        channels = make_reader(file).get_summary().channels.values()
    owners = {(channel.topic, channel.metadata["link"]) for channel in channels if channel.topic != "/tf"}
    assert len(dict(owners)) == len(owners) == len(names) * (1 if bytes_only else 4), "each topic has one link"


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (["arm", "arm"], "two links are named 'arm'"),
        (["x" * 257], "at most 64 links, with names of 256 characters"),
        ([str(number) for number in range(65)], "at most 64 links, with names of 256 characters"),
    ],
)
def test_what_could_not_be_read_again_is_not_recorded(tmp_path, names, said):
    with Session(tmp_path / "x.mcap") as session:
        for name in names[:-1]:
            session.add(StreamPort(frames=1), name=name)
        with pytest.raises(contactfpga.ContactFPGAError, match=said):
            session.add(StreamPort(frames=1), name=names[-1])


@pytest.fixture
def both(tmp_path, monkeypatch):
    """Two boards of one name that were recorded at the same time, each in a file."""
    monkeypatch.setattr(link_recorder, "offset_ns", lambda *clocks: 10**18)
    ports = [StreamPort(frames=300), StreamPort(SKIN.replace(rows=8), frames=200)]
    for number, port in enumerate(ports):
        recorded(tmp_path, port, name=f"{number}.mcap", bytes_only=True)
    return ports, [tmp_path / "0.mcap", tmp_path / "1.mcap"]


def test_merged_boards_of_one_name_are_named_by_their_topics(tmp_path, both):
    ports, files = both
    rewritten(tmp_path / "x.mcap", *files, rename="/robot2")
    recording = Recording(tmp_path / "x.mcap")
    assert len(recording.links) == 2
    for name, port, rows in zip(("/left_hand/bytes", "/robot2/left_hand/bytes"), ports, (16, 8)):
        assert recording.links[name].sheet.rows == rows
        assert b"".join(data for _, data in recording.raw_bytes(name)) == port.sent


@pytest.mark.parametrize("apart", [True, False])
def test_merged_boards_of_one_topic_are_refused(tmp_path, both, capsys, apart):
    rewritten(tmp_path / "x.mcap", *both[1], apart=apart)
    for file in (tmp_path / "x.mcap", recover(tmp_path / "x.mcap").path):
        assert cli.main(["export", str(file), str(tmp_path / "x.csv")]) == 1
        assert "mixes bytes of several boards named 'left hand'" in " ".join(capsys.readouterr().err.split())
        assert not (tmp_path / "x.csv").exists()


ROBOT = """
[[links]]
name = "arm"
frame = "arm_link"
skin = "skin.toml"
port = "{0}"
point_m = [1.0, 0.0, 0.0]
rpy_rad = [0.0, 0.0, 1.5707963267948966]

[[links]]
name = "shin"
skin = "skin.toml"
port = "{1}"
mirrored = true
surface = {{radius_mm = 50.0, slope = 0.1}}
"""


@pytest.fixture
def robot(tmp_path):
    with FakeBoard(SKIN) as arm, FakeBoard(SKIN) as shin:
        (tmp_path / "skin.toml").write_text(SKIN.to_toml())
        (tmp_path / "robot.toml").write_text(ROBOT.format(arm.path, shin.path))
        yield tmp_path / "robot.toml", (arm, shin)


def test_all_links_of_a_robot_by_command(robot, tmp_path):
    path, _ = robot
    file = tmp_path / "x.mcap"
    assert cli.main(["record", str(file), str(path), "--seconds", "0.05", "--timeout", str(LONG)]) == 0
    recording = Recording(file)
    assert set(recording.links) == {"arm", "shin"}
    (texts,) = recording.texts("robot")
    assert texts["toml"] == path.read_text()
    body = Body.load(path)
    with AnyReader([file]) as reader:
        found = [(c.topic, reader.deserialize(raw, c.msgtype)) for c, _, raw in reader.messages()]
    assert "/tf" not in {topic for topic, _ in found}
    for plan in body.links.values():
        (first, *_) = [message for topic, message in found if topic == f"/{plan.name}/zones"]
        assert first.header.frame_id == plan.frame
        zone = first.zones[0]
        point, normal = plan.place(1000 * zone.x, 1000 * zone.y)
        np.testing.assert_allclose((zone.position.x, zone.position.y, zone.position.z), point)
        np.testing.assert_allclose((zone.normal.x, zone.normal.y, zone.normal.z), normal)


def test_a_link_that_is_lost_leaves_the_others(robot, tmp_path, capsys):
    path, (arm, shin) = robot
    body = Body.load(path)
    session = Session(tmp_path / "x.mcap")
    for plan in body.links.values():
        session.add(plan.port, plan.skin, name=plan.name, timeout=LONG)
    session.start()
    shin.unplug()
    (gone,) = [link for link in session.links if link.name == "shin"]
    wait_until(lambda: gone.error is not None)
    assert session.running
    before = session.frames
    arm.send(arm.frame())
    wait_until(lambda: session.frames > before)
    with pytest.raises(contactfpga.PortLost):
        session.stop()
    assert set(Recording(tmp_path / "x.mcap").links) == {"arm", "shin"}


@pytest.mark.parametrize("option", ["--skin", "--units", "--baud"])
def test_what_a_robot_file_says_itself(robot, tmp_path, capsys, option):
    value = "1000000" if option == "--baud" else "x.toml"
    assert cli.main(["record", str(tmp_path / "x.mcap"), str(robot[0]), option, value]) == 1
    assert "sets it for each link" in capsys.readouterr().err


def test_forces_of_units_are_messages(tmp_path):
    from contactfpga.tracking.tracks import Tracks

    taken = []

    class Found(list):
        from contactfpga.robot.haptics import Wrench

        wrench = Wrench((1.0, 2.0, 3.0), (0.1, 0.2, 0.3), frame="bumper")

    def felt(zones, tracks):
        assert isinstance(tracks, Tracks)
        taken.append(zones)
        return Found()

    port = StreamPort(frames=50)
    session = Session(tmp_path / "x.mcap")
    with session:
        session.add(port, felt=lambda board: felt)
        session.start()
        wait_until(lambda: session.wait(0.005) or not port.left)
    with AnyReader([tmp_path / "x.mcap"]) as reader:
        wrenches = [reader.deserialize(raw, c.msgtype) for c, _, raw in reader.messages() if c.topic == "/skin/wrench"]
    assert len(wrenches) == len(taken) > 0
    assert wrenches[0].wrench.force.z == 3.0
