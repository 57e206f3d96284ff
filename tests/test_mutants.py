"""The comparison with the golden model notices changes of the gateware's netlist: a sample of `make mutants`."""

import dataclasses
import itertools

import pytest

from contactfpga.skin import Skin
from contactfpga_sim.board import Board
from contactfpga_sim.compare import Mismatch
from contactfpga_sim.golden import Timeline
from contactfpga_sim.mutants import aig, campaign, netlist, proof, solve, stimuli, trial
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


def test_no_mutant_that_was_killed_is_proved_equivalent_and_most_others_are(sample):
    """The last of each stage that was killed: the prover sees a fault in every part of the design."""
    killed = {mutant.stage: mutant for mutant in sample.mutants if mutant not in sample.left}
    assert set(killed) == {mutant.stage for mutant in sample.mutants}
    proved = proof.equivalent(sample.skin, [*killed.values(), *sample.left[:8]], limit_s=1)
    assert not any(proved[: len(killed)])
    assert sum(proved[len(killed) :]) >= 0.5 * len(sample.left[:8])


def test_without_noise_a_receiver_that_takes_any_pulse_for_a_byte_survives():
    skin = SKINS["8x8"]
    mutants = [m for m in netlist.candidates(skin) if m.place == "serial.py:64" and "const" in m.change]
    quiet = [stimulus for stimulus in stimuli.quick(skin) if not stimulus.noise]
    left = campaign.left_by(skin, mutants, quiet)
    assert left
    assert len(campaign.left_by(skin, left, [s for s in stimuli.quick(skin) if s.noise])) < len(left)


def counter(wraps_at):
    """A graph, what its three latches take next, and the literals of their values: a counter that wraps."""
    graph = aig.Graph(4)
    bits, steps = [2, 4, 6], 8  # the fourth variable is an input: counts while it is high
    wraps = graph.both(graph.both(*(b ^ 1 ^ (wraps_at >> i & 1) for i, b in enumerate(bits[:2]))), 6 ^ 1 ^ (wraps_at >> 2))
    nexts, carry = {}, 1
    for bit in bits:
        counted = graph.both(graph.differ(bit, carry), wraps ^ 1)
        carry = graph.both(bit, carry)
        nexts[bit >> 1] = graph.any([graph.both(steps, counted), graph.both(steps ^ 1, bit)])
    return graph, nexts, bits


@pytest.mark.parametrize("wraps_at", [2, 4, 6, 7])
def test_a_counter_reaches_what_it_counts_to_and_nothing_above(wraps_at, tmp_path):
    for value in range(8):
        graph, nexts, bits = counter(wraps_at)
        bad = graph.both(graph.both(*(b ^ 1 ^ (value >> i & 1) for i, b in enumerate(bits[:2]))), bits[2] ^ 1 ^ (value >> 2))
        answer = solve.reached(graph, nexts, bad, 10, tmp_path)
        assert answer.outcome == ("reached" if value <= wraps_at else "never")
        if answer.outcome == "reached":
            assert sum(clock.get(4, 0) for clock in answer.path[:-1]) % (wraps_at + 1) == value


def test_a_graph_computes_what_its_gates_say():
    graph = aig.Graph(3)
    formula = graph.any([graph.differ(2, 5), graph.both(4, 6), 0])
    for a, b, c in itertools.product((0, 1), repeat=3):
        values = graph.values({1: a, 2: b, 3: c}, [formula])
        assert values[formula >> 1] ^ formula & 1 == ((a ^ (1 - b)) | (b & c))
    assert graph.both(2, 3) == 0
    assert graph.both(2, 1) == graph.both(2, 2) == 2
    assert graph.any([]) == graph.differ(4, 4) == 0


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
