"""The comparison with the golden model notices changes of the gateware's netlist: a sample of `make mutants`."""

import dataclasses

import pytest

from contactfpga.skin import Skin
from contactfpga_sim.board import Board
from contactfpga_sim.compare import Mismatch
from contactfpga_sim.golden import Timeline
from contactfpga_sim.mutants import campaign, netlist, proof, stimuli, trial
from contactfpga_sim.mutants.stimuli import SKINS, Stimulus

SAMPLE = 150


@dataclasses.dataclass
class Sample:
    """Mutants of one Skin, and those that the short stimuli leave."""

    skin: Skin
    mutants: list
    left: list


@pytest.fixture(scope="module")
def sample():
    skin = SKINS["8x8"]
    mutants = netlist.draw(netlist.candidates(skin), SAMPLE, seed=3)
    return Sample(skin, mutants, campaign.left_by(skin, mutants, stimuli.quick(skin)))


def test_short_stimuli_kill_most_mutants(sample, record_property):
    """Not even counting those that are no change, which only a proof can tell."""
    assert len(sample.left) <= 0.25 * SAMPLE
    record_property("cases", SAMPLE)


def test_every_stage_of_the_design_has_mutants(sample):
    assert {mutant.stage for mutant in sample.mutants} == set(netlist.STAGES.values()) - {"debounce"}
    assert {mutant.stage for mutant in netlist.candidates(SKINS["4x4, debounced"])} == set(netlist.STAGES.values())
    assert all(mutant.place.partition(":")[2] for mutant in sample.mutants)


def test_without_a_stimulus_every_mutant_survives(sample):
    nothing = Stimulus("nothing", Timeline([]), 0)
    assert campaign.left_by(sample.skin, sample.mutants, [nothing]) == sample.mutants


def test_an_untouched_sheet_leaves_more_mutants_than_a_touched_one(sample):
    untouched = Stimulus("untouched", Timeline([]), 12_000)
    assert len(campaign.left_by(sample.skin, sample.mutants, [untouched])) > 2 * len(sample.left)


def test_the_board_without_a_mutant_is_held_to_the_golden_model(sample):
    model = netlist.model(sample.skin, sample.mutants)
    stimulus = next(stimuli.quick(sample.skin))
    with Board(sample.skin, trial.OBSERVED, model) as board:
        assert len(trial.expected(board, stimulus)["bytes"]) > 100
    with Board(sample.skin.replace(settle_us=31.0), trial.OBSERVED, model) as board, pytest.raises(Mismatch):
        trial.expected(board, stimulus)


def test_no_mutant_that_was_killed_is_proved_equivalent_and_some_others_are(sample):
    killed = [mutant for mutant in sample.mutants if mutant not in sample.left][:2]
    proved = proof.equivalent(sample.skin, [*killed, *sample.left[:8]])
    assert not any(proved[:2])
    assert any(proved[2:])


def test_a_table_counts_the_fates_by_stage():
    mutants = [
        netlist.Mutant(stage, "x.py:1", f"-mode inv {n}") for n, stage in enumerate(["scan", "scan", "link", "link"])
    ]
    fates = ["killed", "equivalent", "killed", "alive"]
    results = [campaign.Result("8x8", mutant, fate) for mutant, fate in zip(mutants, fates)]
    lines = campaign.table(results).splitlines()
    assert "| scan | 2 | 1 | 1 | 0 | 100.0 % |" in lines
    assert "| link | 2 | 1 | 0 | 1 | 50.0 % |" in lines
    assert lines[-1] == "| all | 4 | 2 | 1 | 1 | 66.7 % |"
    assert campaign.share_killed(results) == pytest.approx(2 / 3)
    assert campaign.listed(results) == "link x.py:1: -mode inv 3  (8x8)"
