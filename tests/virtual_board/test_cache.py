"""The cache of compiled gateware: what others could have written is not loaded."""

import os
import signal
import stat
import subprocess
import sys
import time
from pathlib import Path

import pytest

from contactfpga_sim.board import cache
from contactfpga_sim.board.cache import CacheError
from contactfpga_sim.studies import kept

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
    monkeypatch.setattr(kept, "cache_folder", lambda: folder)
    kept.kept("kind", "key", lambda: 1)
    assert [mode(path) for path in (folder, folder.parent)] == [0o700] * 2
    assert {mode(path) for path in folder.iterdir()} == {0o600}


def test_a_umask_that_takes_everything_is_no_trouble(tmp_path):
    before = os.umask(0o777)
    try:
        assert mode(cache.ready(tmp_path / "a" / "b")) == 0o700
    finally:
        os.umask(before)


@pytest.mark.parametrize("bits", [0o777, 0o770, 0o722, 0o1777])
def test_a_folder_that_others_can_write_is_refused(tmp_path, bits):
    tmp_path.chmod(bits)
    with pytest.raises(CacheError, match=r"can be written by others \(mode 1?7\d+\).*rm -r .*CONTACTFPGA_CACHE"):
        cache.ready(tmp_path)


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


def test_a_folder_that_cannot_be_made_is_told(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(CacheError, match=r"cannot be used: .*; name another folder with CONTACTFPGA_CACHE"):
        cache.ready(tmp_path / "file" / "cache")


def test_what_a_killed_build_left_is_removed_and_what_works_stays(tmp_path):
    code = (
        "import sys, time; from pathlib import Path; from contactfpga_sim.board import cache\n"
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


@pytest.mark.campaign  # it compiles a board in a cache of its own
def test_the_cache_may_be_the_current_folder(tmp_path):
    code = (
        "from contactfpga.skin import Skin; from contactfpga_sim.board.compiled import CompiledBoard\n"
        "with CompiledBoard(Skin(rows=2, columns=2)) as board: board.run(10)"
    )
    environment = os.environ | {"CONTACTFPGA_CACHE": "."}
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=200)
    assert done.returncode == 0, done.stderr
    (library,) = tmp_path.glob("*.so")
    assert mode(library) == 0o600
    library.chmod(0o777)
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=200)
    assert done.returncode != 0
    assert "can be written by others (mode 777)" in done.stderr
