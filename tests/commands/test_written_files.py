"""Files that commands write: whole or not there, and nothing else in their folder is touched."""

import contextlib
import os
import resource
import signal
import stat
import sys

import numpy as np
import pytest
from recorded_stream import recorded

from contactfpga import ContactFPGAError, examples
from contactfpga.inputs.files import replaced, write_text
from contactfpga.robot.body.folds import Folds
from contactfpga.surfaces import Mesh
from contactfpga.tools import cli
from contactfpga.tools.recordings.export import export


@contextlib.contextmanager
def no_room(most=64):
    """A limit on the size of files stands for a full disk."""
    before, wrote = resource.getrlimit(resource.RLIMIT_FSIZE), sys.dont_write_bytecode
    sys.dont_write_bytecode = True  # Python would keep modules cut short
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (most, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        sys.dont_write_bytecode = wrote


def table():
    points = np.moveaxis(np.mgrid[0:2, 0:3, 0:1], 0, -1)[:, :, 0].astype(float)
    return Mesh(points, np.ones((2, 3, 3)), 1.0, 1.0)


def folds():
    return Folds("elbow", 0.05, (4, 4), dict.fromkeys(range(50), 1), dict.fromkeys(range(50), np.ones((4, 4), bool)))


def picture(path):
    pytest.importorskip("matplotlib")
    from contactfpga import picture_style

    picture_style.save(picture_style.new(2.0), path)


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    pytest.importorskip("mcap")
    from contactfpga.recordings import Recording

    folder = tmp_path_factory.mktemp("recorded")
    recorded(folder, bytes_only=True)
    return Recording(folder / "touches.mcap")


WRITERS = {
    "table.csv": export,
    "table.npz": export,
    "table.parquet": export,
    "mesh.npz": lambda _, path: table().save(path),
    "folds.json": lambda _, path: folds().save(path),
    "picture.png": lambda _, path: picture(path),
    "picture.svg": lambda _, path: picture(path),
    "text.toml": lambda _, path: write_text(path, "a = 1\n" * 100),
}


@pytest.fixture(params=WRITERS)
def written(request, recording, tmp_path):
    """Its path, and what writes it."""
    if request.param.endswith("parquet"):
        pytest.importorskip("pyarrow")
    path = tmp_path / request.param
    return path, lambda: WRITERS[request.param](recording, path)


def test_the_same_file_with_and_without_one_before(written):
    path, write = written
    write()
    first = path.read_bytes()
    assert len(first) > 100
    path.write_bytes(b"old")
    write()
    if path.name != "table.parquet":  # which may hold when it was written
        assert path.read_bytes() == first
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize("before", [None, b"old"])
def test_where_there_is_no_room_all_stays_as_it_was(written, before):
    path, write = written
    if before is not None:
        path.write_bytes(before)
    with no_room(), pytest.raises(Exception, match=path.name):
        write()
    assert [(one, one.read_bytes()) for one in path.parent.iterdir()] == ([] if before is None else [(path, before)])


def test_files_and_links_beside_it_are_left_alone(written, tmp_path_factory):
    path, write = written
    precious = tmp_path_factory.mktemp("other") / "precious"
    precious.write_bytes(b"precious")
    others = [path.with_name(path.name + end) for end in (".part", ".tmp", "~")]
    for one in others[:2]:
        one.symlink_to(precious)
    others[2].write_bytes(b"mine")
    write()
    assert sorted(path.parent.iterdir()) == sorted([path, *others])
    assert precious.read_bytes() == b"precious"
    assert [one.is_symlink() for one in others] == [True, True, False]
    assert others[2].read_bytes() == b"mine"


def test_a_file_keeps_its_mode_and_a_new_one_gets_the_usual_one(tmp_path):
    path, usual = tmp_path / "a", tmp_path / "usual"
    usual.touch()
    write_text(path, "1")
    assert stat.S_IMODE(path.stat().st_mode) == stat.S_IMODE(usual.stat().st_mode)
    path.chmod(0o640)
    write_text(path, "2")
    assert stat.S_IMODE(path.stat().st_mode) == 0o640


def test_a_link_that_is_named_stays_one(tmp_path):
    (tmp_path / "there").mkdir()
    link, file = tmp_path / "link.txt", tmp_path / "there" / "file"
    link.symlink_to(file)
    for text in ("1", "2"):
        write_text(link, text)
        assert link.is_symlink()
        assert file.read_text() == text
    assert list(file.parent.iterdir()) == [file]


def test_a_failure_within_leaves_nothing(tmp_path):
    def fail():
        with replaced(tmp_path / "a") as new:
            assert list(tmp_path.iterdir()) == [new]
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not os.path.exists("/dev/stdout"), reason="no /dev/stdout here")
def test_a_pipe_is_written_itself(python):
    code = "from contactfpga.inputs.files import write_text; write_text('/dev/stdout', 'text')"
    assert python(code).stdout == "text"


@pytest.mark.parametrize("command", ["plot", "export"])
def test_commands_say_that_there_is_no_room(recording, tmp_path, monkeypatch, capsys, command):
    if command == "plot":
        pytest.importorskip("matplotlib")
    monkeypatch.chdir(tmp_path)
    target = "touches.png" if command == "plot" else "o.csv"
    with no_room():
        status = cli.main([command, str(recording.path), *(["o.csv"] if command == "export" else [])])
    assert status == 1
    said = " ".join(capsys.readouterr().err.split())
    assert said.startswith(f"contactfpga: {target}")
    assert "File too large" in said
    assert list(tmp_path.iterdir()) == []


def test_looking_at_a_place_makes_no_file_behind_a_link(tmp_path, capsys):
    """Where the link leads to nothing, and the command then fails."""
    behind = tmp_path / "behind"
    (tmp_path / "o.csv").symlink_to(behind)
    assert cli.main(["export", str(examples() / "units.toml"), str(tmp_path / "o.csv")]) == 1
    capsys.readouterr()
    assert not behind.exists()


def test_bytes_are_recorded_into_no_file_that_came_to_be_there(tmp_path, monkeypatch):
    """Between the look and the opening."""
    from contactfpga.driver import recording as recorded_bytes

    path = tmp_path / "x.bin"
    monkeypatch.setattr(recorded_bytes, "check", lambda _: path.write_bytes(b"precious"))
    with pytest.raises(ContactFPGAError, match="is there already"):
        recorded_bytes.FileTap(path)
    assert path.read_bytes() == b"precious"
