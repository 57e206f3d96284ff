"""Flips of single bits: every bit is there, each is followed, and what came of it is judged rightly."""

import json
import types
from pathlib import Path

import numpy as np
import pytest
from study_pages import outdated

from contactfpga import Skin
from contactfpga_sim.lab.flips import campaign, flip, reference, summary, tables, touches
from contactfpga_sim.lab.flips.campaign import DESIGNS, Row
from contactfpga_sim.lab.flips.flip import Flip, FlipOutcome
from contactfpga_sim.lab.flips.reference import DeliveredFrame, Reference
from contactfpga_sim.model.board import native, state
from contactfpga_sim.model.board.state import Bit

PLAIN = Skin(rows=4, columns=4, labeller="serial", fail_safe=True, clock_hz=4_000_000, baud=1_000_000)


def made(skin):
    """The reference of a small board whose flips are followed for less time."""
    with pytest.MonkeyPatch.context() as patch:
        for module in (reference, flip):
            patch.setattr(module, "AFTER_S", 0.06)
            patch.setattr(module, "LAST_S", 0.14)
        of = Reference(skin)
        yield of
        of.board.close()


@pytest.fixture(scope="module")
def plain():
    yield from made(PLAIN)


def place_of(board, name):
    (index,) = (index for index, place in enumerate(board.places) if place.name == name)
    return index


@pytest.mark.slow
def test_every_bit_of_the_synthesized_design_can_be_flipped(plain, tmp_path):
    from contactfpga_hdl.top import Top

    (tmp_path / "top.il").write_text(native.rtlil(Top(PLAIN)))
    native.yosys(f"read_rtlil top.il; {native.FLATTEN}; memory_collect; opt_clean; write_json top.json", tmp_path)
    (module,) = [
        module for module in json.loads((tmp_path / "top.json").read_text())["modules"].values() if "cells" in module
    ]
    cells = list(module["cells"].values())
    ports = [cell["parameters"] for cell in cells if cell["type"] == "$mem_v2"]
    written = [port for port in ports if int(port["WR_PORTS"], 2)]
    registers = sum(len(cell["connections"]["Q"]) for cell in cells if "dff" in cell["type"])
    registers += sum(int(port["WIDTH"], 2) * port["RD_CLK_ENABLE"].count("1") for port in written)
    memories = sum(int(port["WIDTH"], 2) * int(port["SIZE"], 2) for port in written)
    bits = [sum(place.bits for place in plain.board.places if place.memory == memory) for memory in (False, True)]
    assert bits == [registers, memories]


@pytest.mark.slow
def test_each_place_is_drawn_as_often_as_it_has_bits(plain):
    places = plain.board.places
    for memory in (False, True):
        drawn = [each.bit for each in flip.drawn(plain, memory, 4000, 1)]
        assert all(places[bit.place].memory == memory for bit in drawn)
        assert all(bit.word < places[bit.place].depth and bit.bit < places[bit.place].width for bit in drawn)
        wide = max(
            (index for index, place in enumerate(places) if place.memory == memory), key=lambda i: places[i].bits
        )
        share = places[wide].bits / sum(place.bits for place in places if place.memory == memory)
        assert abs(np.mean([bit.place == wide for bit in drawn]) - share) < 0.05


@pytest.mark.slow
def test_a_board_returns_to_a_moment(plain):
    board, step = plain.board, plain.steps[4]
    board.go_to(step.moment)
    board.press(plain.sheets[4])
    board.take("received")
    board.run(plain.step_clocks)
    assert board.take("received").tolist() == step.events.tolist()
    assert board.same(plain.steps[5].moment)
    assert not board.same(plain.steps[6].moment)
    board.flip(Bit(0, 0, 0))
    assert not board.same(plain.steps[5].moment)
    with pytest.raises(ValueError, match="is outside of"):
        board.flip(Bit(0, 1, 0))


@pytest.fixture(scope="module")
def fast():
    yield from made(campaign.skin("run").replace(send="on_change", scan="reversal", precharge_us=0.5))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("place", "bits"),
    [("scan.frame_clock.time", (0, 13, 23)), ("scan.pattern", (0, 3)), ("scan.driver.selected", (1, 2))],
)
def test_a_register_of_the_scan_that_turned_starts_the_board_again(plain, place, bits):
    """In the middle of a microsecond and of a slot."""
    clock = plain.step_clocks * 24 + 4 * 3 + 2
    found = [flip.follow(plain, Flip(Bit(place_of(plain.board, place), 0, bit), clock)) for bit in bits]
    assert {(one.outcome, one.kind) for one in found} == {("told", "restarts")}


@pytest.mark.slow
@pytest.mark.parametrize("region", ["filling", "waiting", "sending"])
def test_frames_that_lost_their_places_start_the_board_again(plain, region):
    """Two of the three would share one from then on, and be sent mixed."""
    place = place_of(plain.board, f"link.{region}")
    clocks = [plain.step_clocks * 24 + clock for clock in (17, 2345, 9876, 15_011)]
    found = [flip.follow(plain, Flip(Bit(place, 0, bit), clock)) for bit in range(2) for clock in clocks]
    assert {(one.outcome, one.kind) for one in found} == {("told", "restarts")}


@pytest.mark.slow
@pytest.mark.parametrize("place", ["backlog.queue.put", "backlog.queue.taken"])
def test_a_queue_that_lost_its_place_is_right_again(plain, place):
    index, number = place_of(plain.board, place), 24
    last = number + round(flip.AFTER_S / touches.STEP_S) + 1
    right = [one.said for step in plain.steps[:last] for one in step.heard]
    for bit in range(plain.board.places[index].width):
        _, heard, _ = flip._run(plain, Flip(Bit(index, 0, bit), plain.step_clocks * number + 17))
        assert [one.said for one in heard][-30:] == right[-30:]


def fake(send="always"):
    """Four sheets of 5 ms, and frames that come half a millisecond after their scan."""
    skin = Skin(rows=4, columns=4, send=send)
    sheets = np.zeros((8, 4, 4), bool)
    sheets[2:, 1:3, 1] = True
    sheets[5:, 1:3, 1] = False
    truth = touches.TruthWindow(skin, sheets)
    return types.SimpleNamespace(skin=skin, truth=truth, late_s=(0.4e-3, 0.6e-3), slack_s=0.5e-3)


NOTHING, HALF, ALL = (0, 0, ()), (1, 1, ((1, 1, 1),)), (2, 1, ((2, 2, 3),))


def heard(time_s, said, late_s=0.5e-3, flagged=False):
    return DeliveredFrame(time_s, said, late_s, flagged)


@pytest.mark.parametrize(
    ("frame", "kind"),
    [
        (heard(0.008, NOTHING), ""),
        (heard(0.008, ALL), "zones"),
        (heard(0.0105, HALF), "zones"),  # the upper row was read after it was touched, the lower one before
        (heard(0.0105, (1, 1, ((1, 1, 2),))), ""),
        (heard(0.0104, ALL), ""),
        (heard(0.0104, NOTHING), ""),
        (heard(0.020, NOTHING), "zones"),
        (heard(0.020, ALL, late_s=3e-3), "time"),
        (heard(0.020, ALL, late_s=-1.0), "time"),
    ],
)
def test_a_frame_is_judged_by_what_was_there(frame, kind):
    assert flip._kind(fake(), frame) == kind


def test_a_change_that_does_not_come_is_wrong_where_frames_come_on_change_only():
    late = [heard(0.008, NOTHING), heard(0.024, ALL)]
    assert [kind for _, kind in flip._wrong(fake("on_change"), late)] == ["stale"]
    assert flip._wrong(fake("on_change"), [heard(0.008, NOTHING), heard(0.0108, ALL)]) == []
    assert flip._wrong(fake(), late) == []


def test_names_are_those_of_the_gateware():
    model = "\twire<3> p_a_2e_b__c_24_7;\n\tmemory<8> memory_p_a_2e_m { 5u };\n\tmemory<8> memory_i_rom { 2u };\n"
    used = model + "memory_p_a_2e_m.update("
    assert state.places(used) == 'PLACE("a.b_c$7", p_a_2e_b__c_24_7)\nMEMORY("a.m", memory_p_a_2e_m, 5)\n'


def test_numbers_are_read_back_as_they_were_written(tmp_path):
    rows = [
        Row("run", FlipOutcome("scan.time", False, "silent", "time", 3, 0.25, float("inf"))),
        Row("run, dual", FlipOutcome("dual.first.link.store", True, "masked", "", 0, 0.0, 0.005)),
    ]
    campaign.write(rows, tmp_path / "flips.csv")
    assert campaign.read(tmp_path / "flips.csv") == rows
    assert summary.share(rows).interval() == pytest.approx((0.095, 0.905), abs=5e-4)
    assert summary.wrong_ms(rows) == (250.0, 250.0)


def test_the_page_says_what_the_numbers_beside_it_say():
    rows, sizes = campaign.read(Path("docs/flips/flips.csv")), summary.read(Path("docs/flips/designs.csv"))
    assert [design.name for design in sizes] == list(DESIGNS)
    assert not outdated("flips", tables.FlipResults(rows, sizes))


def test_a_flip_that_drives_pins_against_each_other_is_followed_and_counted():
    """Of the rows that a board of driven columns selects: a driven column meets one in a pressed switch."""
    skin = PLAIN.replace(scan="reversal", precharge_us=1.0, project_us=1.0, send="on_change", fail_safe=False)
    for fast in made(skin):
        place, first = place_of(fast.board, "scan.cycle.selected"), fast.step_clocks * 24
        found = [
            flip.follow(fast, Flip(Bit(place, 0, row), clock))
            for row in range(4)
            for clock in range(first, first + 120, 7)
        ]
        fights = [one.fights for one in found]
        assert 0 < max(fights) < 100
        assert 0 in fights
