"""A sheet with guard lines that is pulled off while it is touched, alone and among several.

No other test sees a frame without the flag `fault` that lost a touch because of the cable, or a fault that is told of
the wrong sheet.
"""

import numpy as np
import pytest

import contactfpga
from contactfpga import Skin
from contactfpga.driver.conversation import Conversation
from contactfpga.driver.sheets import Sorter
from contactfpga.skin.several import Several
from contactfpga.wire.faults import Faults
from contactfpga.zones.run import Run
from contactfpga_sim.lab.several.tables import told_clocks
from contactfpga_sim.model.board.compiled import CompiledSheets
from contactfpga_sim.model.board.virtual import VirtualBoard

REGISTERS = {"row_drive": "74hc595", "column_read": "74hc165"}
SAFE = {"guard": True, "fail_safe": True, "alive": True, "clock_hz": 4_000_000, "baud": 1_000_000, "settle_us": 25.0}
SKINS = {
    "raster": Skin(rows=4, columns=5, **SAFE),
    "reversal": Skin(rows=4, columns=5, scan="reversal", precharge_us=1.0, **SAFE),
    "registers": Skin(rows=4, columns=5, **REGISTERS, **SAFE),
}
SHEETS = Several(tuple(Skin(rows=4, columns=columns, name=f"{columns}", **REGISTERS, **SAFE) for columns in (5, 3)))
pytestmark = pytest.mark.slow  # each board is compiled
AWAY, RETRY_US = ("all lines open",), 1 << 16


def until(board, done, unseen_us=0.0):
    """The first frame that is ``done``. From ``unseen_us`` on, a frame without the flag has each touch of the full
    sheet."""
    for _ in range(3_000):
        zones = board.next(1.0)
        assert zones.faults or zones.pressed == zones.sheet.rows * zones.sheet.columns or zones.time_us < unseen_us
        if done(zones):
            return zones
    raise AssertionError(zones)


def away(zones):
    return zones.faults == AWAY


def back(zones):
    return not zones.faults


@pytest.mark.parametrize("name", SKINS)
def test_a_sheet_that_is_pulled_off_reads_as_a_fault_and_works_when_it_is_back(name, rng):
    """The sheet is pulled off at random instants of a scan. Line reversal checks its guard lines between frames: frames
    that begin within 0.6 ms may lack touches without the flag."""
    unseen_us = 600 if SKINS[name].reads_rows else 0
    port = VirtualBoard(SKINS[name], "full")
    with contactfpga.open(port) as board:
        for _ in range(5):
            until(board, back)
            port.advance(rng.randrange(4_000))
            port.plug(False)
            pulled_us = port.clock() * 1e6
            named = until(board, away, pulled_us + unseen_us)
            frame_us = SKINS[name].derived.max_frame_clocks / 4
            assert named.time_us - pulled_us < unseen_us + 3 * frame_us
            port.plug(True)
            plugged_us = port.clock() * 1e6
            assert until(board, back).time_us - plugged_us < RETRY_US + 2 * frame_us


class Host:
    """What the driver makes of the bytes of several sheets, in simulated time."""

    def __init__(self, board):
        self.board, self.sorter = board, Sorter()
        self.talks = [Conversation(f"sheet {number}", skin) for number, skin in enumerate(SHEETS.skins)]

    def run(self, cycles):
        """(sheet, frames or report) of everything that comes."""
        self.board.run(cycles)
        for number, packet in self.sorter.take(self.board.receive()):
            for event in self.talks[number].receive(packet, self.board.cycle / SHEETS.clock_hz):
                yield number, event


def test_one_of_two_sheets_is_named_and_the_other_goes_on(rng):
    """Sheet 1 is pulled off with its registers, then bounces for 50 ms; sheet 0 never has a fault."""
    frame = SHEETS.skins[1].derived.frame_clocks
    with CompiledSheets(SHEETS) as board:
        host = Host(board)
        for number, skin in enumerate(SHEETS.skins):
            board.press(number, np.ones((skin.rows, skin.columns), bool))

        def look(cycles, done=lambda event: False):
            """Run until an event of sheet 1 is ``done``; returns whether one is."""
            for number, event in host.run(cycles):
                for zones in event if isinstance(event, Run) else ():
                    assert zones.faults or zones.pressed == zones.sheet.rows * zones.sheet.columns
                    assert number == 1 or not zones.faults
                assert number == 1 or not isinstance(event, Faults)
                if number == 1 and done(event):
                    return True
            return False

        for _ in range(5):
            end = board.cycle + 2 * RETRY_US * 4
            while board.cycle < end:
                look(4_000)
            assert not host.talks[1].lines.reported
            look(rng.randrange(1, frame))
            board.plug(1, False)
            pulled = board.cycle
            while not look(20, lambda event: isinstance(event, Faults) and event.names == AWAY):
                assert board.cycle - pulled < told_clocks(SHEETS, 1)
            end = board.cycle + 200_000  # 50 ms
            while board.cycle < end:
                board.plug(1, bool(rng.randrange(2)))
                look(rng.randrange(400, 12_000))
            board.plug(1, True)
            plugged = board.cycle
            while not look(100, lambda event: isinstance(event, Run) and not list(event)[-1].faults):
                assert board.cycle - plugged < RETRY_US * 4 + 3 * frame + told_clocks(SHEETS, 1)
