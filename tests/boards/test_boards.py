"""Boards: pin tables, what cannot be wired, what is generated from them, and the call of the programmer."""

import dataclasses
import functools
import itertools
from pathlib import Path

import pytest

from contactfpga.boards import BOARDS, find
from contactfpga.boards.spec import Bridge
from contactfpga.driver import finding
from contactfpga.skin import Skin, SkinError
from contactfpga_hdl.board.build import plan_for
from contactfpga_hdl.board.constraints import PAGE
from contactfpga_hdl.board.sites import connector_sites
from contactfpga_hdl.scan.pins import column_pins, row_pins

ROOT = Path(__file__).resolve().parents[2]
ICEBREAKER, ICESTICK, ULX3S = BOARDS["icebreaker"], BOARDS["icestick"], BOARDS["ulx3s-85f"]


@functools.cache
def constraints(name):
    """What place and route gets for a small sheet with `alive`."""
    board = BOARDS[name]
    skin = Skin(rows=3, columns=3, alive=True, settle_us=9, clock_hz=board.clock_hz, baud=1_000_000)
    suffix = board.constraints.partition(".")[2]
    text = plan_for(board, skin).files[f"contactfpga.{suffix}"]
    return text if isinstance(text, str) else text.decode()


every_board = pytest.mark.parametrize("board", BOARDS.values(), ids=list(BOARDS))


# ---- pin tables


def test_a_board_of_your_own_is_named_by_where_it_is():
    assert find("contactfpga.boards.ulx3s:ULX3S_85F") is BOARDS["ulx3s-85f"]
    for name, message in (
        ("no_such:BOARD", "the board 'no_such:BOARD' cannot be loaded: No module named 'no_such'"),
        ("contactfpga.boards:BOARDS", "'contactfpga.boards:BOARDS' is a dict; it must be a BoardSpec"),
    ):
        with pytest.raises(SkinError, match=message):
            find(name)


BITSY = "amaranth_boards.icebreaker_bitsy"


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"contact": "pmod_0:1"}, "`row_side` or `column_side` has a pin that cannot be used: .* physical pin 4, .*"),
        ({"contact": "pmod_9:1"}, "`contact` has a pin that cannot be used: .* nonexistent connector pin pmod_9:1"),
        ({"row_side": ("pmod_0:1",) * 12}, "`row_side` or `column_side` has a pin that cannot be used: .*"),
        ({"uart": ("pmod_2:9", "pmod_2:9")}, "`uart` has a pin that cannot be used: .* already used by .*"),
        ({"held_high": ("pmod_2:10",)}, "`held_high` has a pin that cannot be used: .* already used by .*"),
        (
            {"platform": f"{BITSY}:ICEBreakerBitsyPlatform"},
            "`uart` is None and .* has none; name two pins for .*",
        ),
        ({"platform": f"{BITSY}:Nope"}, "`platform` is .* has no attribute 'Nope'; it is module:class"),
    ],
)
def test_a_field_that_the_platform_cannot_serve_is_named_in_one_sentence(changes, sentence):
    board = dataclasses.replace(BOARDS["icebreaker"], **changes)
    with pytest.raises(SkinError, match=f"^iCEBreaker: {sentence}$"):
        plan_for(board, board.skin)


@every_board
def test_pins_exist_on_the_platform_and_none_is_used_twice(board):
    sites = connector_sites(board)
    pins = [*board.row_side, *board.column_side, board.contact, *(board.uart or ())]
    wired = [sites[pin] for pin in pins] + list(board.held_high)
    assert len(set(wired)) == len(wired)
    assert all(board.label(pin) for pin in pins)


def lines_of(board, rows, columns):
    """Pins of the rows and of the columns."""
    pins = board.pins(Skin(rows=rows, columns=columns, report="cells", settle_us=20.0))
    return pins["rows"], pins["columns"]


@every_board
def test_rows_and_columns_never_share_a_pin(board):
    for rows in range(1, board.lines):
        used = [*itertools.chain(*lines_of(board, rows, board.lines - rows))]
        assert len({*used}) == len(used) == board.lines


@every_board
def test_a_line_keeps_its_pin_in_every_sheet(board):
    most = board.lines - 1
    assert lines_of(board, most, 1)[0][:3] == lines_of(board, 3, 3)[0]
    assert lines_of(board, 1, most)[1][:3] == lines_of(board, 3, 3)[1]


@every_board
@pytest.mark.parametrize(("row_chains", "column_chains"), [(0, 1), (1, 0), (1, 1), (2, 4), (8, 8)])
def test_wires_to_shift_registers_are_ports_of_the_gateware_and_share_no_pin(board, row_chains, column_chains):
    skin = Skin(rows=16 if row_chains else 4, columns=16 if column_chains else 4)
    if row_chains:
        skin = skin.replace(row_drive="74hc595", row_chains=row_chains)
    if column_chains:
        skin = skin.replace(column_read="74hc165", column_chains=column_chains)
    pins, ports = board.pins(skin), row_pins(skin) | column_pins(skin)
    assert {name: len(on) for name, on in pins.items()} == {name: member.shape for name, member in ports.items()}
    used = [*itertools.chain(*pins.values()), board.contact]
    assert len({*used}) == len(used)


@every_board
def test_a_converter_takes_four_pins_which_the_sheet_then_does_not(board):
    most = board.lines - 4 - 1 - 1
    skin = Skin(rows=most, columns=1, units=8, alive=True, settle_us=9)
    pins = board.pins(skin)
    used = [*itertools.chain(*pins.values()), board.contact]
    assert tuple(pins[name][0] for name in ("spi_clock", "spi_select_n", "spi_mosi", "spi_miso")) == board.row_side[-4:]
    assert len({*used}) == len(used) == board.lines + 1
    board.check(skin.replace(clock_hz=board.clock_hz, baud=1_000_000))
    with pytest.raises(SkinError, match="free pins beside `contact` and `alive` and the converter"):
        board.check(skin.replace(columns=2, clock_hz=board.clock_hz, baud=1_000_000))


@every_board
def test_alive_takes_one_pin_which_the_sheet_then_does_not(board):
    most = board.lines - 2
    skin = Skin(rows=most, columns=1, alive=True, settle_us=9)
    pins = board.pins(skin)
    used = [*itertools.chain(*pins.values()), board.contact]
    assert (len(used), pins["alive"]) == (board.lines + 1, (board.column_side[-1],))
    assert len({*used}) == len(used)
    board.check(skin.replace(clock_hz=board.clock_hz, baud=1_000_000))
    alive = [line for line in constraints(board.name).splitlines() if "alive_0" in line]
    assert connector_sites(board)[board.alive] in alive[0].replace('"', " ").split()


@every_board
def test_crystal_is_the_clock_of_the_platform(board):
    stated = [line.split() for line in constraints(board.name).splitlines() if "frequency" in line.lower()]
    hertz = [float(words[-1]) * 1e6 if board.constraints.endswith("pcf") else float(words[-2]) for words in stated]
    assert hertz == [board.clock_hz]


@every_board
def test_port_is_one_that_the_host_looks_for(board):
    names = [usb.boards for usb in finding.SUPPORTED if (usb.vid, usb.pid) == board.bridge.usb]
    assert len(names) == 1
    assert board.title.split()[0] in names[0]


@pytest.mark.parametrize(("diodes", "pulled_up"), [("col2row", 16), ("row2col", 0)])
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


def test_an_external_bridge_has_two_pins_and_a_line_that_rests_high_where_none_is_plugged_in():
    board = BOARDS["ulx3s-12f-ft232h"]
    lpf = plan_for(board, board.skin).files["contactfpga.lpf"]
    lpf = (lpf if isinstance(lpf, str) else lpf.decode()).splitlines()
    sites = connector_sites(board)
    uart = [line for line in lpf if "uart" in line]
    assert [line for line in uart if line.startswith("LOCATE")] == [
        f'LOCATE COMP "uart_1__{name}__io" SITE "{sites[pin]}";' for name, pin in zip(("rx", "tx"), board.uart)
    ]
    assert [("rx" in line) for line in uart if "PULLMODE=UP" in line] == [True]
    assert board.skin.clock_hz / board.skin.baud == 5
    with pytest.raises(
        SkinError, match="baud is 15000000, the FT232H of ULX3S 12F with FT232H reaches 12000000 at most"
    ):
        board.check(board.skin.replace(baud=15_000_000))


# ---- what cannot be built


@pytest.mark.parametrize(
    ("board", "changes", "message"),
    [
        (
            ICEBREAKER,
            {"row_drive": "direct"},
            "16 rows and 16 columns take 16 + 16 wires, iCEBreaker has 23 free pins beside `contact`; "
            'set row_drive = "74hc595"',
        ),
        (
            ICEBREAKER,
            {"row_drive": "direct", "rows": 11, "columns": 11, "guard": True, "alive": True},
            "11 rows and 11 columns with guard lines take 12 + 12 wires, iCEBreaker has 22 free pins beside `contact` "
            "and `alive`; set row_drive",
        ),
        (
            ULX3S,
            {"clock_hz": 12_000_000},
            "clock_hz is 12000000: the PLL (EHXPLLL) makes no such clock from a crystal of 25000000 Hz; nearest are "
            "10000000 and 15000000; or the crystal's own 25000000",
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
    skin = board.skin.replace(row_drive="direct", columns=4)
    board.check(skin.replace(rows=board.lines - 4))
    with pytest.raises(SkinError):
        board.check(skin.replace(rows=board.lines - 3))


def test_unknown_board_is_named_with_the_known_ones():
    with pytest.raises(SkinError, match="no board is called 'arty'; known are icebreaker, icestick, ulx3s-12f"):
        find("arty")


@pytest.mark.parametrize(
    ("asked", "made"),
    [(12_000_000, 12e6), (8_000_000, 8e6), (6_000_000, 6e6), (3_000_000, 3e6), (7_500_000, 8e6), (115_200, 115_246.1)],
)
def test_rates_of_the_bridge(asked, made):
    assert Bridge("FT2232H", (0, 0), None, 12_000_000).nearest(asked) == pytest.approx(made, abs=0.1)
