"""Clocks from the PLL: dividers against every setting there is, and the reset that waits for the lock.

tests/test_bitstream.py compares with the makers' calculators and builds bitstreams.
"""

import pytest

from contactfpga.boards import BOARDS, pll
from contactfpga.skin import SkinError
from contactfpga_hdl.board.build import plan_for
from contactfpga_hdl.board.clock import HeldReset

WHOLE = [megahertz * 1_000_000 for megahertz in range(1, 401)]
"""What a Skin can ask for."""


def taken(cell, crystal):
    found = {}
    for clock in WHOLE:
        try:
            found[clock] = pll.dividers(cell, crystal, clock)
        except SkinError:
            continue
    return found


@pytest.mark.parametrize("crystal", [12_000_000, 16_000_000, 25_000_000])
def test_an_ice40s_clocks_are_all_that_the_formula_makes(crystal):
    clocks = set()
    for divr in range(16):
        for divf in range(128):
            for divq in range(1, 7):
                # In whole Hz, so that nothing is rounded: clock * divided = crystal * times.
                times, divided = divf + 1, (divr + 1) << divq
                compared_ok = 10_000_000 * (divr + 1) <= crystal <= 133_000_000 * (divr + 1)
                oscillator_ok = 533_000_000 * (divr + 1) <= crystal * times <= 1_066_000_000 * (divr + 1)
                output_ok = 16_000_000 * divided <= crystal * times <= 275_000_000 * divided
                if compared_ok and oscillator_ok and output_ok and crystal * times % (divided * 1_000_000) == 0:
                    clocks.add(crystal * times // divided)
    found = taken("SB_PLL40_CORE", crystal)
    assert set(found) == clocks
    assert len(clocks) > 10
    for clock, dividers in found.items():
        assert crystal * (dividers["DIVF"] + 1) == clock * (dividers["DIVR"] + 1) << dividers["DIVQ"]


@pytest.mark.parametrize("crystal", [12_000_000, 25_000_000])
def test_an_ecp5s_clocks_are_all_that_the_formula_makes(crystal):
    clocks = set()
    for clki in range(1, 129):
        for clkfb in range(1, 81):
            output, rest = divmod(crystal * clkfb, clki)
            compared_ok = 3_125_000 * clki <= crystal
            oscillator_ok = any(400_000_000 <= output * clkop <= 800_000_000 for clkop in range(1, 129))
            if rest == 0 and output % 1_000_000 == 0 and 10_000_000 <= output <= 400_000_000:
                clocks |= {output} if compared_ok and oscillator_ok else set()
    found = taken("EHXPLLL", crystal)
    assert set(found) == clocks
    assert len(clocks) > 10
    for clock, dividers in found.items():
        assert crystal * dividers["CLKFB_DIV"] == clock * dividers["CLKI_DIV"]
        assert 400_000_000 <= clock * dividers["CLKOP_DIV"] <= 800_000_000


def test_a_clock_it_cannot_make_is_refused_with_the_nearest():
    with pytest.raises(SkinError) as caught:
        pll.dividers("SB_PLL40_PAD", 12_000_000, 25_000_000)
    assert str(caught.value) == (
        "clock_hz is 25000000: the PLL (SB_PLL40_PAD) makes no such clock from a crystal of 12000000 Hz; "
        "nearest are 24000000 and 27000000; or the crystal's own 12000000"
    )
    with pytest.raises(SkinError, match="nearest are 18000000; or"):
        pll.dividers("SB_PLL40_PAD", 12_000_000, 1_000_000)


@pytest.mark.parametrize(
    ("name", "clock_hz", "parameters"),
    [
        ("icebreaker", 24_000_000, ["\\SB_PLL40_PAD", "\\DIVF 63", "\\DIVQ 5", "\\DIVR 0"]),
        ("icestick", 48_000_000, ["\\SB_PLL40_CORE", "\\DIVF 63", "\\DIVQ 4", "\\DIVR 0"]),
        ("ulx3s-85f", 50_000_000, ["\\EHXPLLL", "\\CLKFB_DIV 2", "\\CLKI_DIV 1", "\\CLKOP_DIV 12"]),
    ],
)
def test_a_board_takes_its_pll_for_another_clock_only(name, clock_hz, parameters):
    board = BOARDS[name]

    def netlist(skin):
        made = plan_for(board, skin).files["contactfpga.il"]
        return made if isinstance(made, str) else made.decode()

    small = board.skin.replace(rows=2, columns=2)
    with_pll = netlist(small.replace(clock_hz=clock_hz))
    assert all(parameter in with_pll for parameter in parameters)
    assert parameters[0] not in netlist(small)
    for oscillator in ("SB_HFOSC", "SB_LFOSC", "OSCG"):
        assert oscillator not in with_pll


def test_reset_waits_for_the_lock_and_comes_back_with_its_loss(bench, rng):
    clocks = 9
    held = HeldReset(clocks)
    levels = [0] * 5 + [1] * 7 + [0] + [1] * 40 + [0] * 3 + [1] * 30 + [rng.random() < 0.9 for _ in range(400)]
    run = bench(held)
    run.drive(held.locked, lambda cycle: int(levels[min(cycle, len(levels) - 1)]))
    reset = run.watch(held.reset)
    run.run(len(levels))
    for cycle in range(len(levels)):
        seen = levels[max(0, cycle - clocks - 3) : max(0, cycle - 2)]
        assert reset[cycle] == (len(seen) <= clocks or not all(seen)), cycle
    assert 0 < sum(reset.values) < len(levels)
