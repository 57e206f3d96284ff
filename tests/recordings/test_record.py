"""What `contactfpga record` writes, replay and Recording read."""

import pytest
from fake_board import wait_until
from recorded_stream import StreamPort, recorded, replayed
from wire import old_frame, old_hello

import contactfpga
from contactfpga import Skin
from contactfpga.recordings import Recording, Session
from contactfpga.robot.ros.feed import offset_ns
from contactfpga.tools import cli

SKIN = Skin()
LONG = 60.0


def test_replay_is_exact_to_the_byte(tmp_path):
    port = StreamPort()
    recorded(tmp_path, port)
    data = b"".join(data for _, data in Recording(tmp_path / "touches.mcap").raw_bytes())
    assert data == port.sent
    (tmp_path / "bytes.bin").write_bytes(port.sent)
    assert replayed(tmp_path / "touches.mcap") == replayed(tmp_path / "bytes.bin")
    with contactfpga.open(f"replay://{tmp_path / 'touches.mcap'}", record=tmp_path / "again.bin") as board:
        assert len(list(board)) > 600
        assert board.stats.lost == 0
    assert (tmp_path / "again.bin").read_bytes() == port.sent


def test_a_recording_says_what_was_recorded(tmp_path):
    recorded(tmp_path, StreamPort(SKIN.replace(name="palm", rows=12)))
    recording = Recording(tmp_path / "touches.mcap")
    assert list(recording.links) == ["left hand"]
    hello = recording.links["left hand"]
    assert (hello.sheet.rows, hello.name) == (12, "palm")
    assert recording.skins == {"left hand": None}  # a hello does not tell all of it
    recorded(tmp_path, name="reference.mcap")
    assert Recording(tmp_path / "reference.mcap").skins == {"left hand": SKIN}


def test_frames_come_with_their_times(tmp_path):
    recorded(tmp_path)  # a frame every ms
    recording = Recording(tmp_path / "touches.mcap")
    every = list(recording.frames())
    assert len(every) == len(replayed(tmp_path / "touches.mcap")) > 600
    assert recording.duration_s == pytest.approx(0.6, abs=0.05)
    assert {link for _, link, _ in every} == {"left hand"}
    times = [t_s for t_s, _, _ in every]
    assert times == sorted(times)
    device = [zones.time_us / 1e6 for _, _, zones in every]
    assert [t - times[50] for t in times[50:]] == pytest.approx([t - device[50] for t in device[50:]], abs=0.002)


def test_its_times_do_not_move_where_the_program_rests_between_two_clocks():
    now_s, rests_s = [7.0], iter([0.0, 3.0, 0.5])

    def look():
        now_s[0] += next(rests_s, 0.0)
        return now_s[0]

    assert offset_ns(lambda: 10**18 + round(look() * 1e9), look) == 10**18


@pytest.mark.parametrize(("start_s", "end_s"), [(0.0, 0.1), (0.234, 0.5), (0.59, None), (1.0, None)])
def test_a_part_of_a_recording_is_the_same_as_in_the_whole(tmp_path, start_s, end_s):
    recorded(tmp_path)
    recording = Recording(tmp_path / "touches.mcap")
    end = 1e9 if end_s is None else end_s
    expected = [(t, zones.to_dict()) for t, _, zones in recording.frames() if start_s <= t < end]
    assert [(t, zones.to_dict()) for t, _, zones in recording.frames(start_s, end_s)] == expected
    assert len(expected) == pytest.approx(min(end, 0.6) * 1000 - min(start_s, 0.6) * 1000, abs=15)


def test_a_file_of_bytes_alone_has_the_times_of_its_board(tmp_path):
    port, file = StreamPort(SKIN.replace(name="palm")), tmp_path / "x.rec"
    recorded(tmp_path, port)
    file.write_bytes(port.sent)
    with contactfpga.open(f"replay://{file}") as board:
        frames = list(board)
    recording = Recording(file)
    times = [(zones.time_us - frames[0].time_us) / 1e6 for zones in frames]
    assert (list(recording.links), recording.skins, recording.start_s) == (["palm"], {"palm": None}, None)
    assert recording.duration_s == pytest.approx(times[-1])
    assert b"".join(data for _, data in recording.raw_bytes()) == port.sent
    for start_s, end_s in ((0.0, None), (0.2, None), (0.2503, 0.3), (times[-1], None)):
        wanted = [(t_s, zones.to_dict()) for t_s, zones in zip(times, frames) if start_s <= t_s < (end_s or 1e9)]
        assert [(t_s, zones.to_dict()) for t_s, _, zones in recording.frames(start_s, end_s)] == wanted
    assert cli.main(["export", str(file), str(tmp_path / "x.csv")]) == 0
    assert (tmp_path / "x.csv").read_text().count("palm") >= len(frames)


def test_a_file_of_an_older_protocol_is_reported(tmp_path):
    (tmp_path / "x.rec").write_bytes(old_hello() + old_frame())
    with pytest.raises(contactfpga.VersionMismatch, match=r"x\.rec speaks protocol version 1, this host version 2"):
        Recording(tmp_path / "x.rec").frames()


def test_replay_starts_at_the_hello_before_a_time(tmp_path):
    recorded(tmp_path, StreamPort())
    file = tmp_path / "touches.mcap"
    with contactfpga.open(f"replay://{file}?start=0.35") as board:
        found = list(board)
    everything = replayed(file)
    assert 0.3 < found[0].time_us / 1e6 < 0.35
    assert [zones.to_dict() for zones in found[1:]] == everything[1 - len(found) :]  # `motion` needs the one before
    with pytest.raises(contactfpga.ContactFPGAError, match=r"lasts 0\.6\d\d s; it cannot start at 4 s"):
        contactfpga.open(f"replay://{file}?start=4")


def test_programs_of_others_read_the_messages(tmp_path):
    from rosbags.highlevel import AnyReader

    port = StreamPort()
    session = recorded(tmp_path, port)
    (link,) = session.links
    with AnyReader([tmp_path / "touches.mcap"]) as reader:
        found = [(c.topic, t, reader.deserialize(raw, c.msgtype)) for c, t, raw in reader.messages()]
    zones = [message for topic, _, message in found if topic == "/left_hand/zones"]
    assert len(zones) == link.frames
    reported = replayed(tmp_path / "touches.mcap")[-len(zones) :]
    assert [one.device_time_us for one in zones] == [one["time_us"] for one in reported]
    assert [one.zones[0].sum_x for one in zones] == [one["zones"][0]["sum_x"] for one in reported]
    assert {one.header.frame_id for one in zones} == {"left hand"}
    data = b"".join(bytes(message.data) for topic, _, message in found if topic == "/left_hand/bytes")
    assert data == port.sent
    drawn = [t for topic, t, _ in found if topic == "/tf"]
    assert len(drawn) == pytest.approx(30 * 0.6, abs=2)
    assert {topic for topic, *_ in found} == {
        "/tf",
        *(f"/left_hand/{w}" for w in ("zones", "bytes", "tracks", "markers")),
    }
    events = [event for topic, _, message in found if topic.endswith("tracks") for event in message.events]
    assert events[0].kind == events[0].DOWN


def test_bytes_only_is_smaller_and_plays_the_same(tmp_path):
    both = [recorded(tmp_path, name=f"{bare}.mcap", bytes_only=bare) for bare in (True, False)]
    assert both[0].size < both[1].size / 2
    assert replayed(tmp_path / "True.mcap") == replayed(tmp_path / "False.mcap")
    assert all(session.size == session.files[0].stat().st_size for session in both)


def test_units_and_faults_are_messages(tmp_path):
    from rosbags.highlevel import AnyReader

    port = StreamPort(SKIN.replace(guard=True), frames=100)
    report = port.model.report
    session = Session(tmp_path / "x.mcap")
    with session:
        session.add(port)
        port.model.word = 1
        port.out += report()
        session.start()
        wait_until(lambda: session.wait(0.005) or not port.left)
    with AnyReader([tmp_path / "x.mcap"]) as reader:
        reported = [
            reader.deserialize(raw, c.msgtype).names for c, _, raw in reader.messages() if c.topic == "/skin/faults"
        ]
    assert [name for names in reported for name in names]


# ---- the command


def run(*arguments):
    return cli.main(["record", *map(str, arguments)])


def test_the_command_says_what_it_wrote(board, tmp_path, capsys):
    file = tmp_path / "touches.mcap"
    board.stream = board.frame
    assert run(file, board.path, "--seconds", 0.05, "--timeout", LONG) == 0
    said = capsys.readouterr().out
    assert f"{file}: 0." in said
    assert "MB an hour" in said
    assert Recording(file).duration_s >= 0


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["x.bin"], "does not end in .mcap"),
        (["there.mcap"], "is there already; name a new file"),
        (["no/folder.mcap"], "no/folder.mcap cannot be written: there is no folder no"),
    ],
)
def test_files_that_cannot_be(arguments, said, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.mcap").write_bytes(b"precious")
    assert run(*arguments, "replay://nothing") == 1
    assert said in capsys.readouterr().err
    assert (tmp_path / "there.mcap").read_bytes() == b"precious"


def test_without_a_board_there_is_no_file(tmp_path, capsys):
    assert run(tmp_path / "x.mcap", "sim://?skin=/no/skin.toml") == 1
    assert "cannot be opened: /no/skin.toml: No such file" in capsys.readouterr().err, "a board, no robot"
    assert run(tmp_path / "x.mcap", tmp_path / "none") == 1
    assert "cannot be opened" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_bytes_that_wait_are_written_though_a_recording_is_played_slowly(tmp_path):
    """Its times are the board's, but what waits is timed by this computer's clock."""
    from model_board import ModelBoard
    from recorded_stream import SKIN as PLAIN

    model = ModelBoard(PLAIN)
    data = model.hello()
    for _ in range(6):
        data += model.frame()
        model.time_us += 50_000
    (tmp_path / "x.bin").write_bytes(data)
    with Session(tmp_path / "x.mcap") as session:
        session.add(f"replay://{tmp_path / 'x.bin'}?pace=1")
        session.start()
        while session.running:
            session.wait(1.0)
    assert len(list(Recording(tmp_path / "x.mcap").raw_bytes())) > 3
