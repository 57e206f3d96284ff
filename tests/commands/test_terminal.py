"""What a terminal is shown: nothing wider than it is, nothing that its encoding lacks, nothing it cannot write over."""

import io
import itertools
import re
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from fake_board import FakeBoard, wait_until
from rich.cells import cell_len
from rich.console import Console
from sample import sample
from terminals import OnTerminal, environment, on_terminal

from contactfpga import Skin, terminal
from contactfpga.tools.console import live
from contactfpga.tools.console.tables import tables

CONTROL = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")
BIG = Skin(rows=64, columns=64, settle_us=20.0)
WIDTHS = (60, 80)


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("files")
    np.save(folder / "frames.npy", np.eye(16, dtype=bool)[None])
    # Boards in Python, as large ones take long to compile.
    with FakeBoard(BIG, folder / "big"), FakeBoard(BIG.replace(report="cells"), folder / "cells"):
        yield folder


COMMANDS = {
    "zones": ["zones", "--once", "sim://?scene=palm"],
    "zones of 64x64": ["zones", "--once", "--timeout", "60", "FILES/big"],
    "zones of 64x64 cells": ["zones", "--once", "--timeout", "60", "FILES/cells"],
    "wire": ["wire", "--once", "--timeout", "60", "FILES/cells"],
    "doctor": ["doctor", "--seconds", "0.01", "sim://"],
    "replay": ["replay", "FILES/frames.npy"],
    "arm": ["study", "arm", "--places", "4", "--output", "FILES/arm"],
    "an error": ["zones", "sim://?scene=no_such_scene_of_this_name"],
    "help": ["--help"],
}


def named(name, files):
    return [argument.replace("FILES", str(files)) for argument in COMMANDS[name]]


def shown(said):
    """Lines as they stand on the terminal in the end."""
    return [line.rpartition("\r")[2] for line in CONTROL.sub("", said).split("\n")]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "columns"),
    sample(
        itertools.product(COMMANDS, WIDTHS),
        quick=[(name, WIDTHS[number % 2]) for number, name in enumerate(COMMANDS) if name != "arm"],
    ),
)
def test_no_line_is_wider_than_the_terminal(name, columns, files):
    _, said = on_terminal(named(name, files), columns)
    assert "Traceback" not in said
    assert "…" not in said
    for line in shown(said):
        # What must not be broken is there to be copied, or is the name of a file.
        assert cell_len(line.rstrip()) <= columns or str(files) in line or "sim://" in line, line


@pytest.mark.parametrize("name", sample(COMMANDS, quick=["zones of 64x64", "doctor", "an error"], slow=["replay"]))
def test_no_character_ends_a_command(name, files):
    command = [sys.executable, "-m", "contactfpga.tools.cli", *named(name, files)]
    result = subprocess.run(command, capture_output=True, env=environment(PYTHONIOENCODING="ascii"), timeout=250)
    assert b"codec" not in result.stdout + result.stderr
    assert result.returncode == (name == "an error"), result.stderr
    (result.stdout + result.stderr).decode("ascii")


@pytest.mark.parametrize("variables", [{"NO_COLOR": "1"}, {"TERM": "dumb"}])
def test_no_color_where_none_is_wanted(variables, files):
    _, said = on_terminal(COMMANDS["zones"], 80, **variables)
    assert not re.search(r"\x1b\[[0-9;]*(3[0-7]|38;|9[0-7])[0-9;]*m", said)
    assert "◎" in said


def test_a_terminal_that_cannot_be_rewritten_is_not():
    dumb = OnTerminal([sys.executable, "-m", "contactfpga.tools.cli", "zones", "sim://"], 80, TERM="dumb")
    wait_until(lambda: dumb.said.count("cells pressed") >= 3)
    dumb.type("\x03")
    assert dumb.wait() == 0
    assert "this terminal cannot be redrawn, so one frame per second is shown" in " ".join(dumb.said.split())
    assert "\x1b" not in dumb.said


def test_what_cannot_be_rewritten_shows_one_frame_per_second_and_the_last(board, run, tmp_path, monkeypatch):
    now_s, sent = [0.0], board.hello()
    clock = SimpleNamespace(monotonic=lambda: now_s[0], sleep=lambda seconds: now_s.append(now_s.pop() + seconds))
    monkeypatch.setattr(live, "time", clock)
    for _ in range(41):
        sent += board.frame()
        board.time_us += live.REFRESH_US
    (tmp_path / "x.rec").write_bytes(sent)
    status, out, _ = run("zones", f"replay://{tmp_path / 'x.rec'}")
    assert (status, out.count("cells pressed")) == (0, 4), "at 0, 1 and 2 s, and at 2.7 s"


@pytest.mark.parametrize(("columns", "lines"), sample([(80, 24), (60, 30)], quick=[(80, 24)]))
def test_the_live_view_of_a_large_sheet_stays_on_the_screen(columns, lines):
    with FakeBoard(BIG) as board:
        board.moments = [(9, 300, 300), (4, 8, 240), (30, 60, 30)]
        board.stream = board.frame
        patient = ["zones", board.path, "--timeout", "60"]  # a busy machine lets the board wait
        on = OnTerminal([sys.executable, "-m", "contactfpga.tools.cli", *patient], columns, lines)
        wait_until(lambda: on.process.poll() is not None or on.said.count("cells pressed") > 2)
        on.type("\x03")
        assert on.wait() == 0
    frames = re.split(r"\x1b\[2K(?:\x1b\[1A\x1b\[2K)+|\x1b\[\?25l", on.said)
    whole = [frame for frame in frames if "cells pressed" in frame]
    assert whole
    for frame in whole[:-1]:
        rows = shown(frame)
        assert len(rows) <= lines
        assert "◎ barycenter" in frame
        assert max(cell_len(row.rstrip()) for row in rows) <= columns


# ---- the module


class Stream(io.StringIO):
    def __init__(self, encoding):
        super().__init__()
        self._encoding = encoding

    @property
    def encoding(self):
        return self._encoding


def test_a_pipe_has_no_width_unless_one_is_asked_for(monkeypatch):
    monkeypatch.delenv("COLUMNS", raising=False)
    there = terminal.of(Stream("utf-8"))
    assert (there.width, there.height, there.wraps, there.live) == (terminal.PIPE_WIDTH, None, False, False)
    monkeypatch.setenv("COLUMNS", "70")
    assert (terminal.of(Stream("utf-8")).width, terminal.of(Stream("utf-8")).wraps) == (70, False)
    for nonsense in ("", "0", "-5", "wide", "٣"):
        monkeypatch.setenv("COLUMNS", nonsense)
        assert terminal.of(Stream("utf-8")).width == terminal.PIPE_WIDTH


def test_what_an_encoding_lacks_is_written_as_what_is_nearest():
    code = "from contactfpga import terminal; terminal.prepare(); print('a · b, mm², δ, é, 漢, \\udcff')"
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, env=environment(PYTHONIOENCODING="ascii")
    )
    assert result.stdout.rstrip() == b"a | b, mm2, d, e, ?, \xff"


def test_long_text_hangs_and_what_is_to_be_copied_stays_whole():
    text = "fault " + "word " * 12 + "do this:\n" + "x" * 70
    first, second, command = terminal.wrapped(text, 60, 6).split("\n")
    assert first.startswith("fault word")
    assert second.startswith(("      word", "      do"))
    assert command == "x" * 70


def test_no_item_of_a_list_is_broken():
    lines = terminal.listed("at: ", [f"({row}, 7)" for row in range(30)], 40).split("\n")
    assert len(lines) > 3
    assert all(line.count("(") == line.count(")") and len(line) <= 40 for line in lines)


ROWS = [
    ["zones by", "scan", "LUT4", "latency in us", "verdict"],
    ["run, 8", "raster", "1,234", "120 / 160", "misses one limit by far, " * 4 + "[red]"],
    ["single", "reversal", "567", "130 / 170", "the answer"],
]


@pytest.mark.parametrize("width", [24, 30, 40, 60, 80, 120, 200])
def test_a_table_of_any_width_says_everything(width):
    stream = io.StringIO()
    console = Console(file=stream, width=width)
    parts = list(tables(ROWS, width, keys=2, texts=(4,), title="A title"))
    for table in parts:
        console.print(table)
    said = stream.getvalue()
    assert all(cell_len(line) <= width for line in said.split("\n"))
    letters = "".join(said.split())
    for word in ("1,234", "567", "reversal", "A", "title"):
        assert word in letters
    assert "…" not in said
    assert letters.count("far") == 4 or width < 60  # broken within words where it is very narrow
    if width >= 200:
        assert len(parts) == 1
        assert "[red]" in said
