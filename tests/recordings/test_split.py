"""A recording in several files one after the other, which are read one by one or together."""

import pytest
from recorded_stream import NAMES, StreamPort, recorded, recorded_both, replayed

from contactfpga.recordings import Recording
from contactfpga.tools import cli
from contactfpga.tools.recordings.recorder import Split

SPLIT = {"split": Split(bytes=3_000), "bytes_only": True}


def test_split_files_each_begin_with_a_hello_and_lose_nothing(tmp_path):
    port = StreamPort(frames=2000)
    session = recorded(tmp_path, port, **SPLIT)
    assert len(session.files) > 2
    assert [file.name for file in session.files[:2]] == ["touches_0001.mcap", "touches_0002.mcap"]
    pieces = [b"".join(data for _, data in Recording(file).raw_bytes()) for file in session.files]
    assert b"".join(pieces) == port.sent
    counts = [len(replayed(file)) for file in session.files]
    (tmp_path / "all.bin").write_bytes(port.sent)
    assert sum(counts) == len(replayed(tmp_path / "all.bin"))
    assert all(counts)


def test_a_link_that_says_no_hello_delays_no_file_for_long(tmp_path, monkeypatch):
    from contactfpga.tools.recordings import recorder

    monkeypatch.setattr(recorder, "PATIENCE_S", 0.0)
    port = StreamPort(frames=1000, hello_every=1 << 30)
    session = recorded(tmp_path, port, **SPLIT)
    assert len(session.files) > 1
    assert b"".join(data for file in session.files for _, data in Recording(file).raw_bytes()) == port.sent
    assert b"".join(data for _, data in Recording(tmp_path / "touches.mcap").raw_bytes()) == port.sent


def test_all_files_are_read_by_the_name_that_was_recorded_to(tmp_path):
    port = StreamPort(frames=2000)
    session = recorded(tmp_path, port, **SPLIT)
    (tmp_path / "all.bin").write_bytes(port.sent)
    whole = Recording(tmp_path / "touches.mcap")
    assert replayed(tmp_path / "touches.mcap") == replayed(tmp_path / "all.bin")
    assert whole.start_s == Recording(session.files[0]).start_s
    assert whole.skins == Recording(session.files[0]).skins
    assert whole.texts("contactfpga") == Recording(session.files[0]).texts("contactfpga")
    every = [(t_s, zones.to_dict()) for t_s, _, zones in whole.frames()]
    assert len(every) == len(replayed(tmp_path / "all.bin"))
    late = Recording(session.files[-1])
    begin_s = late.start_s - whole.start_s
    assert whole.duration_s == pytest.approx(begin_s + late.duration_s)
    for start_s, end_s in ((begin_s - 0.03, begin_s + 0.03), (begin_s + 0.01, 1e9), (0.4, 0.9)):
        part = [(t_s, zones.to_dict()) for t_s, _, zones in whole.frames(start_s, end_s)]
        assert part == [(t_s, zones) for t_s, zones in every if start_s <= t_s < end_s]
        assert part


def test_seconds_are_those_of_what_is_recorded(tmp_path):
    """A virtual board's are not the computer's."""
    port = StreamPort(frames=2000)
    session = recorded(tmp_path, port, split=Split(seconds=0.5), bytes_only=True)
    lasts_s = [Recording(file).duration_s for file in session.files]
    assert len(lasts_s) == 4
    assert lasts_s[:-1] == pytest.approx([0.5] * 3, abs=0.06)


def test_each_link_goes_on_from_file_to_file(tmp_path):
    ports, session = recorded_both(tmp_path / "x.mcap", **SPLIT)
    assert len(session.files) > 1
    whole = Recording(tmp_path / "x.mcap")
    for name, port in zip(NAMES, ports):
        assert b"".join(data for _, data in whole.raw_bytes(name)) == port.sent
    times = [t_s for t_s, _, _ in whole.frames()]
    assert times == sorted(times)


def test_a_missing_file_is_named(tmp_path, capsys):
    session = recorded(tmp_path, StreamPort(frames=2000), **SPLIT)
    session.files[1].unlink()
    assert cli.main(["export", str(tmp_path / "touches.mcap"), str(tmp_path / "x.csv")]) == 1
    said = capsys.readouterr().err.replace("\n  ", " ")
    assert "touches_0002.mcap is missing; read the other files one by one, by their own names" in said


def test_a_file_of_that_name_goes_first(tmp_path):
    recorded(tmp_path, StreamPort(frames=2000), **SPLIT)
    port = StreamPort(frames=100)
    recorded(tmp_path, port, bytes_only=True)
    assert b"".join(data for _, data in Recording(tmp_path / "touches.mcap").raw_bytes()) == port.sent
