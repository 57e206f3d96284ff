"""`contactfpga doctor`: what it finds, and what it says."""

import dataclasses
import json
import os
import threading

import pytest
from fake_board import FakeBoard, background, patiently

import contactfpga
from contactfpga.driver import finding, health
from contactfpga.driver.stats import Stats

SKIN = contactfpga.Skin()


# ---- doctor


def test_doctor_finds_nothing_wrong(board, run):
    status, out, _ = doctored(run, board, "--seconds", 0.01)
    assert status == 0, out
    assert f"ok    {board.path} may be read and written" in out
    facts = "16x16, pitch 10 x 10 mm, plane, connectivity 8, report 'moments'"
    assert f"says hello: {facts}, 12 MHz, 3000000 baud, fingerprint {SKIN.fingerprint.hex()}" in out
    assert "0 lost, 0 damaged" in out


def doctored(run, board, *arguments, skip=0, cut=0):
    """What the command says of a board that sends frames once it counts them; ``skip`` sequence numbers are left out
    on the way, and of the next frame all but ``cut`` bytes, which damages the one after it."""
    counts, ended, count = threading.Event(), threading.Event(), health.count

    def send():
        counts.wait(60)
        for index in range(200):
            if index == 100:
                for _ in range(skip):
                    board.frame()
            board.send(board.frame()[: cut if index == 100 and cut else None])
        while not ended.wait(0.01):  # for one that is late
            board.send(board.frame())

    with pytest.MonkeyPatch.context() as changed, background(send):
        changed.setattr(health, "count", lambda *asked: counts.set() or count(*asked))
        try:
            return run("doctor", *arguments, "--timeout", 60, board.path)
        finally:
            ended.set()


def test_doctor_counts_what_is_lost(board, run):
    status, out, _ = doctored(run, board, "--seconds", 0.015, skip=7)
    assert status == 1
    assert "fault 7 lost, 0 damaged" in out


@pytest.mark.parametrize(("skip", "warns"), [(7, True), (0, False)])
def test_doctor_asks_for_a_second_reader_where_bytes_are_taken_away(board, run, skip, warns):
    _, out, _ = doctored(run, board, "--seconds", 0.015, skip=skip, cut=5)
    assert f"fault {skip + 2} lost, 1 damaged" in out
    question = f"does another program read this port? `fuser {board.path}` lists them"
    assert (question in " ".join(out.split())) == warns


def test_doctor_prints_one_json_object(board, run):
    status, out, errors = doctored(run, board, "--json", "--seconds", 0.015, skip=7)
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
    status, out, errors = patiently(
        lambda timeout_s: run("doctor", "--timeout", timeout_s, board.path),
        lambda found: "says hello" in found[1],
        (0.3, 3.0, 60.0),
    )
    assert (status, errors) == (1, "")
    assert f"ok    {board.path} says hello" in out
    assert out.splitlines()[-1].startswith("fault ")


@pytest.mark.parametrize(
    ("board_s", "host_s", "reported"),
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
def test_doctor_compares_clocks(board_s, host_s, reported):
    findings = list(health.clock(board_s, host_s))
    assert [verdict for verdict, _ in findings] == ([] if reported is None else ["note"])
    assert reported is None or reported in findings[0][1]


def test_doctor_takes_ghosts_for_no_fault(run):
    with FakeBoard(contactfpga.Skin(diodes="none", connectivity=4)) as board:
        board.moments = [(1, 0, 0), (1, 5, 0)]
        status, out, _ = doctored(run, board, "--seconds", 0.01)
    assert status == 0, out
    assert "the last frame has zones that may be ghosts" in out


def test_doctor_of_a_silent_board(board, run):
    board.answers = False
    status, out, _ = run("doctor", "--timeout", 0.2, board.path)
    assert status == 1
    assert "fault" in out
    assert "not one byte came" in out


def test_doctor_lists_candidates(monkeypatch, board, run):
    board.answers = False
    monkeypatch.setattr(finding, "candidates", lambda: [finding.Candidate(board.path, "ULX3S")])
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
    assert len(rules) == len(finding.SUPPORTED)
    for rule, usb in zip(rules, finding.SUPPORTED, strict=True):
        assert f'ATTRS{{idVendor}}=="{usb.vid:04x}", ATTRS{{idProduct}}=="{usb.pid:04x}"' in rule
        assert 'ATTR{latency_timer}="1", ATTR{event_char}="256"' in rule  # 256: enabled, byte 0
