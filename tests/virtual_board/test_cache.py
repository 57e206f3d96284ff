"""The cache of compiled gateware: what others could have written is not loaded."""

import os
import signal
import stat
import subprocess
import sys
import time
from pathlib import Path

import pytest

from contactfpga_sim.apps import result_cache
from contactfpga_sim.model.board import cache
from contactfpga_sim.model.board.cache import CacheError

ME = os.geteuid()
OTHER = 12345


@pytest.fixture
def umask_000():
    before = os.umask(0)
    yield
    os.umask(before)


def mode(path):
    return stat.S_IMODE(path.lstat().st_mode)


@pytest.mark.usefixtures("umask_000")
def test_modes_do_not_depend_on_the_umask(tmp_path, monkeypatch):
    folder = cache.ready(tmp_path / "a" / "b")
    with cache.locked(folder / "x.lock"), cache.scratch(folder, "build") as work:
        assert mode(work) == 0o700
    monkeypatch.setattr(result_cache, "cache_folder", lambda: folder)
    result_cache.cached("kind", "key", lambda: 1)
    assert [mode(path) for path in (folder, folder.parent)] == [0o700] * 2
    assert {mode(path) for path in folder.iterdir()} == {0o600}


def test_a_umask_that_takes_everything_is_no_trouble(tmp_path):
    before = os.umask(0o777)
    try:
        assert mode(cache.ready(tmp_path / "a" / "b")) == 0o700
    finally:
        os.umask(before)


@pytest.mark.parametrize("bits", [0o777, 0o770, 0o722, 0o1777])
@pytest.mark.parametrize("named", [False, True])
def test_a_folder_that_others_can_write_is_refused(tmp_path, monkeypatch, bits, named):
    tmp_path.chmod(bits)
    monkeypatch.setenv("CONTACTFPGA_CACHE", str(tmp_path) if named else "")
    advice = "" if named else r"what lies there .* \(rm -r .*\), or "
    says = rf"can be written by others \(mode 1?7\d+\); {advice}name another folder with CONTACTFPGA_CACHE$"
    with pytest.raises(CacheError, match=says):
        cache.ready(tmp_path)


@pytest.mark.parametrize("path", ["/dev/null", "file", "pipe"])
def test_what_is_no_folder_is_refused_and_nobody_is_told_to_delete_it(tmp_path, monkeypatch, path):
    (tmp_path / "file").touch()
    os.mkfifo(tmp_path / "pipe")
    monkeypatch.setenv("CONTACTFPGA_CACHE", str(tmp_path / path))
    with pytest.raises(CacheError, match=r"is not a folder; name another folder with CONTACTFPGA_CACHE$"):
        cache.ready(cache.cache_folder())


def test_a_folder_in_one_that_anybody_can_write_is_refused(tmp_path):
    tmp_path.chmod(0o777)
    with pytest.raises(CacheError, match="where anybody can replace it"):
        cache.ready(tmp_path / "cache")
    tmp_path.chmod(0o1777)
    assert cache.ready(tmp_path / "cache") == tmp_path / "cache"


@pytest.fixture
def not_mine(monkeypatch):
    """Makes a path another user's: root gives it away, anybody else becomes root."""
    return (lambda path: os.chown(path, OTHER, OTHER)) if ME == 0 else lambda _: monkeypatch.setattr(os, "geteuid", int)


def test_what_belongs_to_another_is_refused(tmp_path, not_mine):
    library = tmp_path / "x.so"
    library.touch(0o600)
    assert cache.trusted(library)
    not_mine(library)
    not_mine(tmp_path)
    for check, path in ((cache.trusted, library), (cache.ready, tmp_path)):
        with pytest.raises(CacheError, match=r"belongs to user \d+, not to you or root"):
            check(path)


@pytest.mark.skipif(ME != 0, reason="only root can give a folder away")
@pytest.mark.parametrize("depth", [1, 2])
def test_a_folder_in_one_of_another_user_is_refused(tmp_path, depth):
    """Who owns a folder can replace what lies in it, though it belongs to somebody else."""
    folder = tmp_path.joinpath(*"abc"[: depth + 1])
    cache.ready(folder)
    other = folder.parents[depth - 1]
    os.chown(other, OTHER, OTHER)
    with pytest.raises(CacheError, match=rf"lies in {other}, where user {OTHER} can replace it; name another folder"):
        cache.ready(folder)
    other.chmod(0o1777)
    assert cache.ready(folder) == folder


def test_what_belongs_to_root_is_trusted_by_all(monkeypatch):
    monkeypatch.setattr(os, "geteuid", lambda: OTHER)
    root = Path("/usr")
    assert root.stat().st_uid == 0
    assert cache.ready(root) == root


@pytest.mark.parametrize("bits", [0o666, 0o620, 0o602])
def test_a_library_that_others_can_write_is_refused(tmp_path, bits):
    library = tmp_path / "x.so"
    library.touch()
    library.chmod(bits)
    with pytest.raises(CacheError, match="can be written by others"):
        cache.trusted(library)


def test_links_are_not_followed(tmp_path):
    target = tmp_path / "precious"
    target.write_text("x")
    for name in ("x.so", "x.lock"):
        (tmp_path / name).symlink_to(target)
    with pytest.raises(CacheError, match="not a regular file"):
        cache.trusted(tmp_path / "x.so")
    with pytest.raises(CacheError, match=r"x\.lock in the cache cannot be opened"), cache.locked(tmp_path / "x.lock"):
        pass
    assert target.read_text() == "x"


def test_what_a_killed_build_left_is_removed_and_what_works_stays(tmp_path):
    code = (
        "import sys, time; from pathlib import Path; from contactfpga_sim.model.board import cache\n"
        "with cache.scratch(Path(sys.argv[1]), 'build') as work: print(work, flush=True); time.sleep(60)"
    )
    command = [sys.executable, "-c", code, str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        left = process.stdout.readline().strip()
        (tmp_path / "build-just-begun").mkdir()
        old = tmp_path / "build-of-an-older-version"
        old.mkdir()
        os.utime(old, (time.time() - 3600,) * 2)
        with cache.scratch(tmp_path, "build") as work:
            working = {os.path.basename(left), work.name}
            assert {path.name for path in tmp_path.iterdir()} == {*working, "build-just-begun"}
        process.send_signal(signal.SIGKILL)
    with cache.scratch(tmp_path, "build") as work:
        assert {path.name for path in tmp_path.iterdir()} == {work.name, "build-just-begun"}


ANSWER = """
import ctypes, subprocess, sys
from pathlib import Path
from contactfpga_sim.model.board import cache, native

def build(model, compiler, library):
    with cache.scratch(library.parent, "build") as work:
        code = 'extern "C" const char zeros[100000] = {}; extern "C" int answer() { return 42; }'
        command = [*compiler, "-shared", "-fPIC", "-xc++", "-", "-o", work / "a.so"]
        subprocess.run(command, input=code, text=True, check=True)
        cache.put(work / "a.so", library)
    print("built")

native._build = build
print(native.load(native.Model("the answer", "label.cpp", "answer", None)).answer())
"""


def answer(folder):
    """Status and output of a process that loads a library from the cache, and makes it if there is none."""
    environment = os.environ | {"CONTACTFPGA_CACHE": str(folder)}
    command = [sys.executable, "-c", ANSWER]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=250, check=False)
    return done.returncode, done.stdout.split(), done.stderr


DAMAGES = {
    "emptied": lambda data: b"",
    "cut by a byte": lambda data: data[:-1],
    "flipped in the middle": lambda data: data[:5000] + bytes([data[5000] ^ 4]) + data[5001:],
}


def test_a_damaged_library_is_not_loaded_but_built_again(tmp_path):
    assert answer(tmp_path) == (0, ["built", "42"], "")
    assert answer(tmp_path) == (0, ["42"], "")
    (library,) = tmp_path.glob("*.so")
    good = library.read_bytes()
    for what, damaged in DAMAGES.items():
        library.write_bytes(damaged(good))
        warning = f"contactfpga: {library} in the cache is damaged; it is made again\n"
        assert answer(tmp_path) == (0, ["built", "42"], warning), what
        assert library.read_bytes() == good, what
    assert answer(tmp_path) == (0, ["42"], "")


@pytest.mark.parametrize("damaged", [b"", b"0" * 64, None])
def test_a_library_without_its_sum_is_built_again(tmp_path, damaged):
    answer(tmp_path)
    (total,) = tmp_path.glob("*.so.sum")
    if damaged is None:
        total.unlink()
    else:
        total.write_bytes(damaged)
    status, said, warning = answer(tmp_path)
    assert (status, said) == (0, ["built", "42"])
    assert "is damaged; it is made again" in warning
    total.chmod(0o666)
    status, said, warning = answer(tmp_path)
    assert status == 1
    assert "can be written by others (mode 666)" in warning


def test_a_damaged_result_is_worked_out_again(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("CONTACTFPGA_CACHE", str(tmp_path))
    assert result_cache.cached("kind", "key", lambda: [1, 22]) == [1, 22]
    (path,) = tmp_path.glob("*.json")
    for damaged in (b"", b"[1, 2", b"[1, 23]"):
        path.write_bytes(damaged)
        assert result_cache.cached("kind", "key", lambda: [1, 22]) == [1, 22]
        assert capsys.readouterr().err == f"contactfpga: {path} in the cache is damaged; it is made again\n"
    assert result_cache.cached("kind", "key", lambda: 5) == [1, 22]
