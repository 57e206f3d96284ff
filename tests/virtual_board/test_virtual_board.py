"""The virtual board: simulated time, a pseudo-terminal in real time, and the library it is compiled to."""

import os
import re
import select
import signal
import subprocess
import sys
import threading
import time
import tty
from pathlib import Path

import numpy as np
import pytest
from fake_board import wait_until
from frames import decoded
from slow_skin import SLOW

from contactfpga.errors import ContactFPGAError, MissingTool
from contactfpga.skin import Skin
from contactfpga_sim.model.board import native, pty_board
from contactfpga_sim.model.board.compiled import CompiledBoard
from contactfpga_sim.model.board.pty_board import PtyBoard
from contactfpga_sim.model.board.virtual import VirtualBoard
from contactfpga_sim.model.golden import Timeline, predict, requests
from contactfpga_sim.verify.cosim import bench_native
from contactfpga_sim.verify.cosim.compare import compare


def test_the_compiled_board_is_the_golden_models_in_every_clock(record_property):
    skin = Skin()
    rng = np.random.default_rng(11)
    frames = rng.random((300, 16, 16)) < rng.choice([0.02, 0.1, 0.5, 0.9], (300, 1, 1))
    stuck = [rng.random(16) < 0.1 if index % 7 == 0 else None for index in range(300)]
    timeline = Timeline.frames(skin, frames, stuck, requests([5_000, 100_000, 100_400], 4))
    cycles = 300 * 16 * 72
    events = compare(predict(skin, timeline, cycles), bench_native.run(skin, timeline, cycles))
    assert events > 30_000
    record_property("cases", cycles)


def test_time_passes_only_while_it_is_read():
    with VirtualBoard(SLOW, "full") as board:
        assert board.clock() == 0
        assert board.read(0) == b""
        assert board.clock() == 0
        data = b""
        while board.clock() < 0.02:
            data += board.read(0.001)
        assert 0.02 <= board.clock() < 0.022
        frames = decoded(data, SLOW)[0]
        assert len(frames) > 40
        assert {frame.cells for frame in frames} == {16}
        assert [frame.sequence for frame in frames] == list(range(len(frames)))


def test_a_scene_is_asked_for_the_time():
    seen = []

    def scene(seconds):
        seen.append(seconds)
        return np.full((4, 4), seconds > 0.002)

    with VirtualBoard(SLOW, scene) as board:
        data = b""
        while board.clock() < 0.005:
            data += board.read(0.001)
    assert seen == sorted(seen)
    pressed = [(frame.time_us, frame.cells) for frame in decoded(data, SLOW)[0]]
    assert {0, 16} <= {cells for _, cells in pressed}
    first = min(time_us for time_us, cells in pressed if cells)
    assert 2000 <= first <= 2700


def test_cells_of_another_size_are_refused():
    with CompiledBoard(SLOW) as board, pytest.raises(ValueError, match=r"\(4, 5\); the sheet is 4x4"):
        board.press(np.zeros((4, 5), bool))
    with pytest.raises(ValueError, match="not known"):
        VirtualBoard(SLOW, "elbow")


def read_until(path, enough):
    """Bytes that a client reads until they are ``enough``, for as long as a busy machine takes."""
    port = os.open(path, os.O_RDWR | os.O_NOCTTY)
    try:
        tty.setraw(port)
        data, deadline = b"", time.monotonic() + 60
        while not enough(data):
            left = deadline - time.monotonic()
            assert left > 0, f"{len(data)} bytes came"
            if select.select([port], [], [], left)[0]:
                data += os.read(port, 4096)
        return data
    finally:
        os.close(port)


def whole_frames(data):
    """Frames of what a client has read that came in the middle of one."""
    return decoded(data.partition(b"\0")[2], SLOW)[0]


def test_a_pty_board_keeps_real_time_and_outlives_its_clients():
    """Clock and slip together follow the time since the board began, which lies between two readings of the test."""
    board = PtyBoard(SLOW, "full")
    earliest = time.monotonic()
    with board:
        wait_until(board.clock)
        latest = time.monotonic()
        for _ in range(3):
            assert read_until(board.port, lambda data: len(whole_frames(data)) > 100)
        for _ in range(20):
            asked, shown = time.monotonic(), board.clock()
            # So much that the board has compared its clock with real time after the question, however late it ran.
            wait_until(lambda: board.clock() > shown + 1.5 * pty_board.CHUNK_S)  # noqa: B023
            elapsed = board.clock() + board.slip
            assert elapsed <= time.monotonic() - earliest + 2 * pty_board.CHUNK_S
            assert elapsed >= asked - latest - pty_board.MAX_LAG_S
            time.sleep(0.05)
    assert board.failure is None
    assert not Path(board.port).exists() or board._master < 0
    board.stop()


def test_what_nobody_reads_is_dropped_and_counted():
    with PtyBoard(SLOW) as board:
        wait_until(lambda: board.dropped)
        assert read_until(board.port, whole_frames)


@pytest.mark.parametrize(
    ("skin", "share", "advice"),
    [
        (
            Skin(),
            0.3,
            "(70%): one second of the board takes 1.4 s, and times are the board's; with clock_hz = 6000000 in",
        ),  # 7 MHz does not make 3 Mbaud
        (Skin(baud=1_000_000), 0.3, "; with clock_hz = 7000000 in its Skin, this computer would keep up"),
        (Skin(), 0.95, "(5%): one second of the board takes 20.0 s, and times are the board's; a clock with which"),
    ],
)
def test_a_slow_board_says_which_clock_would_hold(skin, share, advice):
    assert advice in pty_board.slip_warning(skin, share)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_command_ends_cleanly_and_takes_its_link_away(tmp_path, number):
    skin, link = tmp_path / "slow.toml", tmp_path / "port"
    skin.write_text(SLOW.to_toml())
    command = [sys.executable, "-m", "contactfpga.tools.cli", "board", "--skin", str(skin), "--symlink", str(link)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout.readline().strip() == str(link)
    assert read_until(link, len)
    process.send_signal(number)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 0, err
    assert re.search(r"ended: the board ran for \d+\.\d s in \d+\.\d s of real time \(\d+%\)\n", err)
    assert not link.is_symlink()


def test_signals_within_the_handler_of_another_end_it_too():
    """A second signal at each line of the handler of the first, or of functions that it calls, ends the board too."""
    board = PtyBoard(SLOW)

    def again(*_):
        sys.settrace(None)
        handler()
        sys.settrace(again)
        return again

    with board._ended_by_signals():
        handler = signal.getsignal(signal.SIGTERM)
        thread = threading.Thread(target=lambda: (sys.settrace(again), handler()), daemon=True)
        thread.start()
        thread.join(60)
    assert not thread.is_alive()
    board._run()  # which ends at once
    board.stop()


def test_a_link_that_cannot_be_made_is_an_error(tmp_path):
    with pytest.raises(ContactFPGAError, match="cannot link"):
        PtyBoard(SLOW, link=tmp_path / "no" / "folder")


def test_another_skin_or_source_is_another_library():
    assert native.skin_key(Skin()) != native.skin_key(Skin(settle_us=6.0))
    assert native.skin_key(Skin()) == native.skin_key(Skin(rows=16))


def test_a_missing_compiler_names_the_command_that_installs_it(monkeypatch):
    monkeypatch.setenv("CXX", "no-such-compiler")
    with pytest.raises(MissingTool, match=r"no-such-compiler.*install it with"):
        CompiledBoard(Skin(rows=2, columns=3))
    monkeypatch.delenv("CXX")
    monkeypatch.setenv("PATH", "")
    with pytest.raises(MissingTool, match=r"C\+\+ compiler"):
        native.find_compiler()


def test_a_compiler_that_refuses_is_reported_and_leaves_nothing(monkeypatch, tmp_path):
    monkeypatch.setenv("CONTACTFPGA_CACHE", str(tmp_path))
    monkeypatch.setenv("CXX", "false")
    with pytest.raises(native.CompileFailed, match="false"):
        CompiledBoard(Skin(rows=2, columns=2))
    assert not list(tmp_path.glob("*.so"))
