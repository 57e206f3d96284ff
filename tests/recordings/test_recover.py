"""What is left of a recording after kill -9, on a full disk, and after damage."""

import json
import os
import re
import resource
import shlex
import signal
import subprocess
import sys
import time

import pytest
from fake_board import FakeBoard, wait_until
from mcap.reader import make_reader
from mcap.writer import IndexType
from recorded_stream import NAMES, recorded_both, rewritten

import contactfpga
from contactfpga import Skin
from contactfpga.recordings import Recording
from contactfpga.tools import cli
from contactfpga.tools.recordings import mcap
from contactfpga.tools.recordings.mcap_file import CHUNK_BYTES, FLUSH_S, McapFile
from contactfpga.tools.recordings.recover import recover

SKIN = Skin()
LONG = 60.0
LOST_BYTES, LOST_S = 1 << 16, 0.2  # what the issue allows
KIND = "contactfpga_msgs/Bytes"
UNKEPT = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}
"""Where files may not grow, Python would keep modules cut short."""


def record(file, port, **options):
    command = [sys.executable, "-m", "contactfpga", "record", str(file), port, "--timeout", str(LONG)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)


def limited(limit):
    """For a child, before it starts: its files may hold this many bytes."""

    def limit_files():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    return limit_files


def raw_bytes(file):
    """Those of its link, as far as they can be recovered."""
    into = file.with_stem(f"try_{time.monotonic_ns()}")
    try:
        recover(file, into)
    except contactfpga.ContactFPGAError:
        return b""
    return b"".join(data for _, data in Recording(into).raw_bytes())


def test_after_kill_9_all_that_was_sent_is_there(tmp_path, capsys):
    """A board falls silent after a message: that message is recorded at once and waits for no other one."""
    file = tmp_path / "x.mcap"
    with FakeBoard(SKIN) as board:
        process = record(file, board.path)
        try:
            wait_until(lambda: file.exists() and file.stat().st_size > 0)
            board.send(sent := b"".join(board.frame() for _ in range(600)))
            wait_until(lambda: raw_bytes(file).endswith(sent), pause_s=0.1)
            assert process.poll() is None, "it wrote them before it ended"
        finally:
            process.kill()
            process.communicate()
    with pytest.raises(contactfpga.ContactFPGAError, match=f"contactfpga record --recover {file}"):
        Recording(file)
    assert cli.main(["record", "--recover", str(file)]) == 0
    assert "x_recovered.mcap" in capsys.readouterr().out
    assert b"".join(data for _, data in Recording(tmp_path / "x_recovered.mcap").raw_bytes()).endswith(sent)


def test_no_more_waits_than_what_may_be_lost(tmp_path):
    """With a clock that we turn."""
    assert CHUNK_BYTES <= LOST_BYTES
    assert FLUSH_S <= LOST_S / 2
    file = McapFile(tmp_path / "x.mcap")
    written = lambda: (tmp_path / "x.mcap").stat().st_size  # noqa: E731
    before = written()
    file.write("/a", KIND, "a", 0, bytes(100), 10.0)
    file.flush_old(10.0 + 0.99 * FLUSH_S)
    assert written() == before
    file.flush_old(10.0 + 1.01 * FLUSH_S)
    assert written() > before
    for size in (30_000, 30_000, 30_000, 70_000, 10):
        before, data = written(), os.urandom(size)
        file.write("/a", KIND, "a", 0, data, 20.0)
        assert file.size - written() <= max(LOST_BYTES, size + 100)
    file.close()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_what_ends_a_program_closes_the_file(tmp_path, number):
    with FakeBoard(SKIN) as board:
        file = tmp_path / "x.mcap"
        process = record(file, board.path)
        wait_until(lambda: file.exists() and file.stat().st_size > 0)
        process.send_signal(number)
        out, errors = process.communicate(timeout=LONG)
    assert process.returncode == 0
    assert errors == ""
    assert f"{file}: " in out
    assert len(list(Recording(file).frames())) >= 1


def test_a_full_disk_is_said_and_what_is_there_is_whole(tmp_path):
    """A limit on the size of files stands for it."""
    limit = 40_000
    with FakeBoard(SKIN) as board:
        file = tmp_path / "x.mcap"
        process = record(file, board.path, preexec_fn=limited(limit), env=UNKEPT)
        wait_until(lambda: file.exists() and file.stat().st_size > 0)
        board.stream = board.frame
        _, errors = process.communicate(timeout=LONG)
    assert process.returncode == 1
    whole = f"the {file.stat().st_size:,} bytes that are there are whole"
    assert f"{file}: there is no room for more (File too large); {whole}" in errors
    assert f"contactfpga record --recover {file}" in errors
    assert "Traceback" not in errors
    assert 1000 < file.stat().st_size <= limit
    found = recover(file)
    assert (found.cut, found.damaged, found.closed) == (0, 0, False)
    assert len(list(Recording(found.path).frames())) > 10


# ---- what other programs write

UNREPEATED = {"repeat_channels": False, "repeat_schemas": False}
WAYS = {
    "no chunks": {"use_chunking": False},
    "no index": {"index_types": IndexType.NONE},
    "no statistics": {"use_statistics": False},
    "no repetition": UNREPEATED,
    "no summary": {**UNREPEATED, "index_types": IndexType.NONE, "use_statistics": False, "use_summary_offsets": False},
    "large chunks": {"chunk_size": 1 << 25},
}


@pytest.mark.parametrize("limit", [0, 1000])
def test_a_full_disk_before_the_first_message_leaves_no_file(tmp_path, limit):
    """There would be nothing in it to recover."""
    file = tmp_path / "x.mcap"
    with FakeBoard(SKIN) as board:
        process = record(file, board.path, preexec_fn=limited(limit), env=UNKEPT)
        _, errors = process.communicate(timeout=LONG)
    assert process.returncode == 1
    assert "nothing was recorded. Make room, then record again" in " ".join(errors.split())
    assert "--recover" not in errors
    assert not file.exists()


@pytest.mark.parametrize("way", WAYS)
def test_whole_files_are_read_however_they_are_written(tmp_path, capsys, way):
    ports, _ = recorded_both(tmp_path / "x.mcap")
    file = tmp_path / "other.mcap"
    rewritten(file, tmp_path / "x.mcap", **WAYS[way])
    assert cli.main(["record", "--recover", str(file)]) == 0
    assert f"Nothing is missing: {file}" in " ".join(capsys.readouterr().out.split())
    times = [t_s for t_s, _, _ in Recording(tmp_path / "x.mcap").frames(0.1, 0.2)]
    assert times
    for path in (file, tmp_path / "other_recovered.mcap"):
        recording = Recording(path)
        assert recording.skins == Recording(tmp_path / "x.mcap").skins
        for name, port in zip(NAMES, ports):
            assert b"".join(data for _, data in recording.raw_bytes(name)) == port.sent
        assert [t_s for t_s, _, _ in recording.frames(0.1, 0.2)] == times


def test_what_is_too_large_is_named_and_the_rest_is_kept(tmp_path, capsys, monkeypatch):
    """With a lower limit, that a test may reach."""
    recorded_both(tmp_path / "x.mcap")
    rewritten(tmp_path / "large.mcap", tmp_path / "x.mcap", chunk_size=1 << 18)
    with open(tmp_path / "large.mcap", "rb") as file:
        sizes = [one.uncompressed_size for one in make_reader(file).get_summary().chunk_indexes]
    monkeypatch.setattr(mcap, "LARGEST", sizes[0] - 1)
    assert sizes[-1] < sizes[0]
    assert cli.main(["export", str(tmp_path / "large.mcap"), str(tmp_path / "x.csv")]) == 1
    said = " ".join(capsys.readouterr().err.split())
    assert "large.mcap has a chunk of 0.3 MiB; the limit is 0 MiB; write it with smaller chunks" in said
    assert "damaged" not in said
    assert cli.main(["record", "--recover", str(tmp_path / "large.mcap")]) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert f"Left out: {sum(size >= sizes[0] for size in sizes)} pieces above" in out
    assert "Nothing is missing" not in out


# ---- damage


@pytest.fixture
def closed(tmp_path):
    """A closed file, the eight messages in its four chunks, and where these end."""
    file, messages, ends = McapFile(tmp_path / "closed.mcap"), [os.urandom(500) for _ in range(8)], []
    file.metadata("contactfpga", {"link": "a", "skin": ""})
    for number, data in enumerate(messages):
        file.write("/a", KIND, "a", number, data, 0.0)
        if number % 2:
            file.flush()
            ends.append(file.size)
    file.close()
    return tmp_path / "closed.mcap", messages, ends


def read(path):
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True)
        texts = [one.metadata for one in reader.iter_metadata()]
        return [message.data for _, _, message in reader.iter_messages()], texts


def test_a_closed_file_is_copied(closed):
    path, messages, _ = closed
    found = recover(path)
    assert (found.closed, found.messages, found.damaged, found.cut) == (True, 8, 0, 0)
    assert read(found.path) == (messages, [{"link": "a", "skin": ""}]) == read(path)


@pytest.mark.parametrize("share", [0.35, 0.5, 0.66, 0.85, 0.99])
def test_a_file_that_ends_anywhere_gives_all_whole_pieces(closed, tmp_path, share):
    path, messages, ends = closed
    data = path.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data[: int(share * len(data))])
    kept, _ = read(recover(cut).path)
    assert kept == messages[: len(kept)]
    whole = sum(end <= cut.stat().st_size for end in ends)
    assert len(kept) in (2 * whole, 2 * whole + 2)  # what is cut off may be an index alone


@pytest.mark.parametrize("number", range(4))
@pytest.mark.parametrize("what", ["content", "a large size", "a small size"])
def test_a_damaged_piece_is_left_out_and_counted(closed, tmp_path, capsys, number, what):
    """Also the first one, which holds the definitions of all messages. The index says where the next one begins."""
    path, messages, ends = closed
    with open(path, "rb") as file:
        begin = [one.chunk_start_offset for one in make_reader(file).get_summary().chunk_indexes][number]
    data = bytearray(path.read_bytes())
    if what == "content":
        data[ends[number] - 400] ^= 1
    else:
        data[begin + 2] = 255 if what == "a large size" else 0
    path.write_bytes(data)
    assert cli.main(["record", "--recover", str(path), str(tmp_path / "new.mcap")]) == 0
    assert re.search("Left out in between: [1-9]", capsys.readouterr().out)
    assert read(tmp_path / "new.mcap")[0] == messages[: 2 * number] + messages[2 * number + 2 :]


@pytest.mark.parametrize(
    ("end", "more", "said"),
    [
        *((-cut, b"", "Left out at the end: ") for cut in (5, 30, 100)),
        (None, b"x" * 1234, "Left out after the end: 1,234 bytes that are no recording."),
    ],
)
def test_a_file_with_a_wrong_end_is_not_called_whole(closed, tmp_path, capsys, end, more, said):
    """All messages are there, and yet it cannot be read as it is."""
    path, messages, _ = closed
    path.write_bytes(path.read_bytes()[:end] + more)
    assert cli.main(["record", "--recover", str(path), str(tmp_path / "json.mcap"), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["usable"], answer["beyond_bytes"], answer["messages"]) == (False, len(more), len(messages))
    assert cli.main(["record", "--recover", str(path), str(tmp_path / "new.mcap")]) == 0
    out = capsys.readouterr().out
    assert "Nothing is missing" not in out
    assert said in out
    assert read(tmp_path / "new.mcap")[0] == messages


def recording(path, link, data):
    """A closed file with one message of another link, whose numbers are those of the others' links."""
    file = McapFile(path)
    file.metadata("contactfpga", {"link": link, "skin": ""})
    file.write(f"/{link}", KIND, link, 100, data, 0.0)
    file.close()
    return path.read_bytes()


def topics(path):
    with open(path, "rb") as file:
        return [(channel.topic, message.data) for _, channel, message in make_reader(file).iter_messages()]


def test_two_recordings_in_one_file_are_both_recovered(closed, tmp_path, capsys):
    path, messages, _ = closed
    path = path.rename(tmp_path / "two in one.mcap")
    path.write_bytes(path.read_bytes() + recording(tmp_path / "b.mcap", "b", b"second"))
    with pytest.raises(contactfpga.ContactFPGAError) as refused:
        contactfpga.open(f"replay://{path}")
    join = shlex.join(["contactfpga", "record", "--recover", str(path)])
    assert str(refused.value) == f"{path} holds several recordings, one after the other; join them with: {join}"
    assert cli.main(["record", "--recover", str(path), str(tmp_path / "new.mcap")]) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert f"{path} holds 2 recordings, one after the other; the new file has them all." in out
    assert "Nothing is missing" not in out
    assert "Left out" not in out
    kept, texts = read(tmp_path / "new.mcap")
    assert kept == [*messages, b"second"]
    assert [text["link"] for text in texts] == ["a", "b"]
    assert topics(tmp_path / "new.mcap") == [*(("/a", data) for data in messages), ("/b", b"second")]


@pytest.mark.parametrize("first", [True, False])
def test_definitions_of_one_recording_are_not_taken_for_another(closed, tmp_path, first):
    """Its first piece, with the definitions, is damaged; links of both have the same numbers."""
    path, messages, ends = closed
    mine, other = bytearray(path.read_bytes()), recording(tmp_path / "b.mcap", "b", b"second")
    mine[ends[0] - 400] ^= 1
    path.write_bytes(mine + other if first else other + mine)
    found = recover(path, tmp_path / "new.mcap")
    assert (found.recordings, found.damaged) == (2, 1)
    assert sorted(topics(found.path)) == sorted([*(("/a", data) for data in messages[2:]), ("/b", b"second")])


def test_a_recording_behind_one_that_was_not_closed_is_recovered(closed, tmp_path):
    path, messages, ends = closed
    path.write_bytes(path.read_bytes()[: ends[1]] + recording(tmp_path / "b.mcap", "b", b"second"))
    found = recover(path, tmp_path / "new.mcap")
    assert (found.recordings, found.usable) == (2, False)
    assert topics(found.path) == [*(("/a", data) for data in messages[:4]), ("/b", b"second")]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "is no MCAP file"),
        (b"\x89MCAP0\r\n", "not one whole message"),
        (b"\x89MCAP0\r\n\x06" + b"\xff" * 40, "not one whole message"),
    ],
)
def test_what_is_no_recording(tmp_path, content, said, capsys):
    path = tmp_path / "x.mcap"
    path.write_bytes(content)
    assert cli.main(["record", "--recover", str(path)]) == 1
    assert said in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == [path]
    with pytest.raises(contactfpga.ContactFPGAError):
        list(Recording(path).frames())
