"""The comparison with the golden model notices changes of the gateware's netlist: a sample of `make mutants`."""

import dataclasses
import itertools

import pytest

from contactfpga.skin import Skin
from contactfpga.skin.units import SUM_THRESHOLD, THRESHOLD
from contactfpga_sim.lab.mutants import tables
from contactfpga_sim.model.board.compiled import CompiledBoard
from contactfpga_sim.model.golden import Timeline, units
from contactfpga_sim.model.golden.facts import facts
from contactfpga_sim.model.golden.request import heard
from contactfpga_sim.verify import aig
from contactfpga_sim.verify.cosim.compare import Mismatch
from contactfpga_sim.verify.mutants import campaign, netlist, proof, sheets, stimuli
from contactfpga_sim.verify.mutants.skins import OPTIONS, SEVERAL, SKINS
from contactfpga_sim.verify.mutants.stimuli import Stimulus

SAMPLE = 40


@dataclasses.dataclass
class Sample:
    """Mutants of one Skin, and those that the short stimuli leave."""

    skin: Skin
    all: list
    mutants: list
    left: list


@pytest.fixture(scope="module")
def sample():
    skin = SKINS["8x8"]
    candidates = netlist.candidates(skin)
    mutants = netlist.draw(candidates, SAMPLE, seed=3)
    return Sample(skin, candidates, mutants, campaign.left_by(skin, mutants, stimuli.quick(skin)))


@pytest.mark.slow
def test_short_stimuli_kill_most_mutants(sample, record_property):
    """Short stimuli kill most mutants, even if equivalent mutants, which only a proof can tell, count as alive."""
    assert len(sample.left) <= 0.25 * SAMPLE
    record_property("cases", SAMPLE)


@pytest.mark.slow
def test_every_stage_of_the_design_has_mutants(sample):
    assert {mutant.stage for mutant in sample.all} == {"scan", "label", "report", "pack", "link", "serial", "top"}
    skin, drawn = OPTIONS["3x4, reversal, guard, self-test"]
    found = netlist.candidates(skin)
    assert {"guard", "self-test", "faults"} <= {mutant.stage for mutant in found} & {*drawn}
    files = {mutant.place.partition(":")[0] for mutant in found}
    assert {"link/request.py", "link/alive.py", "scan/reversal_guard.py", "top.py"} <= files


@pytest.mark.parametrize(
    ("line", "stage"),
    [
        (r"-cell $flatten\request$134.$175 -port Y -src /a folder/contactfpga_hdl/link/request.py:124", "serial"),
        (r"-cell $flatten\label.\walk.$130 -port A -src /site-packages/amaranth/lib/memory.py:9", "label"),
        (r"-cell $auto$ff.cc:337:slice$2260 -port D -src /hdl/contactfpga_hdl/scan/self_test.py:43", "self-test"),
        (r"-cell $auto$opt_expr.cc:277$1863 -port Y -wire audit$7.counts -wirebit 3", "report"),
        (r"-cell $flatten\sheet_1.\request$99.$182 -port A -wire bits", "serial"),
        (r"-cell $flatten\grants.$4 -port A -src /hdl/contactfpga_hdl/several.py:80", "several"),
        (r"-cell $auto$simple.cc:194:make_patterns_logic$2090 -port B", None),
        (r"-cell $auto$ff.cc:337:slice$2260 -port CLK -src /hdl/contactfpga_hdl/scan/self_test.py:43", None),
    ],
)
def test_a_mutant_counts_for_the_stage_of_its_source_else_of_its_module(line, stage):
    mutant = netlist.parsed(f"mutate -mode inv -module top {line}")
    assert (mutant and mutant.stage) == stage


def test_no_noise_comes_where_pulses_are_bits():
    noisy = {name: any(one.noise for one in stimuli.quick(SKINS[name])) for name in ("8x8", "4x4, debounced")}
    assert noisy == {"8x8": True, "4x4, debounced": False}


@pytest.mark.parametrize(
    ("skin", "wrong"),
    [
        ("2x2, units at their own pace", {"what": THRESHOLD, "amount": 1}),
        ("2x2, units at their own pace", {"what": SUM_THRESHOLD, "amount": 1}),
        ("2x2, units at their own pace", {"what": SUM_THRESHOLD, "amount": -1}),
        *(("2x2, units", {"what": SUM_THRESHOLD, "place": 2, "lost": 1 << bit}) for bit in (15, 20)),
    ],
)
def test_stimuli_of_units_notice_amounts_one_off_and_thresholds_without_a_bit(monkeypatch, skin, wrong):
    """Stimuli reach amounts at a threshold and one beside it. Sum 2 of this Skin never reaches 2**15, but its
    thresholds may have more bits."""
    skin = OPTIONS[skin][0]
    timeline, cycles = stimuli.thresholds(skin, 240)
    asked = heard(timeline.received, facts(skin).bit_clocks, commands=True).requests
    right = units.play(facts(skin), timeline, asked, cycles).over

    def reached(settings, what, place, cycle, amount):
        threshold, is_set = settings.at(what, place, cycle)
        if what == wrong["what"] and place == wrong.get("place", place):
            amount, threshold = amount + wrong.get("amount", 0), threshold & ~wrong.get("lost", 0)
        return is_set and amount >= threshold

    monkeypatch.setattr(units._Settings, "reached", reached)
    assert units.play(facts(skin), timeline, asked, cycles).over != right


@pytest.mark.slow
def test_mutants_of_several_sheets_are_told_from_the_golden_model_s_line():
    several, _ = SEVERAL["two sheets"]
    found = netlist.candidates(several)
    places = {mutant.place.partition(":")[0] for mutant in found if mutant.stage in ("several", "serial")}
    assert {"several.py", "link/request.py"} <= places
    assert not any("upset" in mutant.place for mutant in found)
    mutants = netlist.draw([mutant for mutant in found if mutant.stage == "several"], 20)
    nothing = Stimulus("nothing", Timeline([]), 0, others=[Timeline([])])
    assert campaign.left_by(several, mutants, [nothing]) == mutants
    assert len(campaign.left_by(several, mutants, [next(sheets.quick(several))])) < 10


@pytest.mark.slow
def test_what_only_a_flip_can_reach_has_no_mutants(sample):
    assert not any("upset" in mutant.place for mutant in sample.all)


@pytest.mark.slow
def test_without_a_stimulus_every_mutant_survives(sample):
    nothing = Stimulus("nothing", Timeline([]), 0)
    assert campaign.left_by(sample.skin, sample.mutants, [nothing]) == sample.mutants


@pytest.mark.slow
def test_what_time_was_too_short_for_is_open_and_neither_reported_nor_proved(monkeypatch, sample):
    monkeypatch.setattr(netlist, "draw", lambda *_: sample.mutants)
    found = campaign.examine("8x8", SAMPLE, 0, budget_s=0.0)
    assert [one.mutant for one in found if one.fate == "open"] == sample.left
    assert {one.fate for one in found} == {"killed", "open"}
    assert campaign.left_by(sample.skin, sample.mutants, stimuli.quick(sample.skin), until=0.0) == sample.mutants


@pytest.mark.slow
def test_the_board_without_a_mutant_is_held_to_the_golden_model(sample):
    model = netlist.model(sample.skin, sample.mutants)
    stimulus = next(stimuli.quick(sample.skin))
    with CompiledBoard(sample.skin, campaign.OBSERVED, model) as board:
        assert len(campaign.expected(board, stimulus)["bytes"]) > 100
    with CompiledBoard(sample.skin.replace(settle_us=31.0), campaign.OBSERVED, model) as board, pytest.raises(Mismatch):
        campaign.expected(board, stimulus)


@pytest.mark.campaign
def test_a_design_whose_memories_are_no_powers_of_two_deep_can_be_asked_about():
    skin, stages = OPTIONS["5x5, closed, serial"]
    mutant = next(one for one in netlist.candidates(skin) if one.stage in stages)
    assert proof.equivalent(skin, [mutant], limit_s=2) in ([True], [False])


def equals(graph, bits, value):
    result = 1
    for place, bit in enumerate(bits):
        result = graph.both(result, bit ^ 1 ^ (value >> place & 1))
    return result


@pytest.mark.parametrize("highest", [2, 4, 6])
def test_a_counter_reaches_what_it_counts_to_and_nothing_above(highest, tmp_path):
    """Three latches that count while an input is high, and begin again after ``highest``."""
    graph = aig.Graph(4)
    bits, counts = [2, 4, 6], 8
    ends = equals(graph, bits, highest)
    nexts, carry = {}, 1
    for bit in bits:
        counted = graph.both(graph.differ(bit, carry), ends ^ 1)
        carry = graph.both(bit, carry)
        nexts[bit >> 1] = graph.any([graph.both(counts, counted), graph.both(counts ^ 1, bit)])
    answer = aig.reached(graph, nexts, equals(graph, bits, highest), 10, tmp_path)
    assert answer.outcome == "reached"
    assert sum(clock[counts >> 1] for clock in answer.path[:-1]) % (highest + 1) == highest
    assert aig.reached(graph, nexts, equals(graph, bits, highest + 1), 10, tmp_path).outcome == "never"


def test_a_prover_that_fails_says_what_yosys_says(monkeypatch, tmp_path):
    monkeypatch.setattr(aig, "_SOME_GATE", "no netlist\n")
    with pytest.raises(RuntimeError, match=r"status 1:\nERROR: .*: no"):
        aig.reached(aig.Graph(1), {}, 2, 10, tmp_path)


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
    lines = str(tables.table(results)).splitlines()
    assert "| scan | 2 | 1 | 1 | 0 | 100.0 % |" in lines
    assert "| link | 2 | 1 | 0 | 1 | 50.0 % |" in lines
    assert lines[-1] == "| all | 4 | 2 | 1 | 1 | 66.7 % |"
    assert tables.listed(results) == "link x.py:1: -mode inv 3  (8x8)"
