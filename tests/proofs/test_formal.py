"""The proofs hold, find the bugs planted for them, and the machinery around them can say no."""

from functools import partial

import pytest
from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out

from contactfpga_sim.verify.proofs import upset
from contactfpga_sim.verify.proofs.__main__ import CASES, main
from contactfpga_sim.verify.proofs.case import Bug, ProofCase, prove, search

LONG_S = 7000
LONG = {
    "records are the zones, 3 columns, 4 rows, 8-connected",
    "serial: records are the zones, 3 columns, 4 rows, 8-connected",
    "serial: nothing overflows, 3 columns, 4 rows, 8-connected",
    "nothing overflows, nothing is left, 4 columns, 4-connected",
    "serial: nothing overflows, 2 columns, 4 rows, 4-connected",
    "rows find the zones, 3x3, 4-connected",
    "records are the zones, 1 columns, 4 rows, 8-connected",
    "records are the zones, 1 columns, 4 rows, 4-connected",
    "serial: records are the zones, 1 columns, 4 rows, 8-connected",
    "serial: records are the zones, 1 columns, 4 rows, 4-connected",
    "a stall changes nothing, 8 columns, 4-connected",
    "an end mark a frame, 8 columns, 4-connected",
    "serial: stalls change nothing, 8 columns, 4 rows, 4-connected",
    "zones are divided, 2x2, 1 fraction bit",
    "backlog keeps each item, 16 items",
    "pins never meet, 2x1, shortest times",
    "pins never meet, 2x1, guard lines, row2col, shortest times",
    "whole lines are not reported, 3x2",
    "frames of a line reversal, 8x2",
    "a closed switch is reported, 8x4",
    "the next frame in time, 8x2, long times",
    "the next frame in time, 3x2, long precharge",
    "times of a line reversal, 3x2, long release",
    "contact in three clocks, 3x2, shortest times, row2col",
    "differences stop the line, two copies",
    "grants go round, 16 sheets",
    "packets of several sheets are whole, 1x2",
}
"""Quick for `make formal`, but not the case of their claim that each run of the tests holds."""


def _first_of_each_claim(cases):
    first = {}
    for case in cases:
        first.setdefault(case.claim, case)
    return list(first.values())


QUICK = _first_of_each_claim(case for case in CASES if not case.campaign and case.name not in LONG)
QUICK_BUGS = _first_of_each_claim(case for case in CASES if case.bugs and not case.campaign)[::2]


def _cases_with_marks():
    for case in CASES:
        yield pytest.param(case, id=case.name, marks=[] if case in QUICK else [pytest.mark.campaign])


def _bugs_with_marks():
    for case in CASES:
        for bug in case.bugs:
            quick = case in QUICK_BUGS and bug is case.bugs[0]
            yield pytest.param(case, bug, id=f"{case.name}: {bug.name}", marks=[] if quick else [pytest.mark.campaign])


def test_what_is_left_to_the_campaign_is_there():
    assert {case.name for case in CASES} >= LONG
    assert {case.claim for case in QUICK} == {case.claim for case in CASES}


@pytest.mark.whole
@pytest.mark.parametrize("case", list(_cases_with_marks()))
def test_the_claim_holds(case):
    verdict = case.run(limit_s=LONG_S if case.campaign else 200)
    assert verdict.outcome == "proved", verdict.said[-5000:]


@pytest.mark.slow
@pytest.mark.parametrize(("case", "bug"), list(_bugs_with_marks()))
def test_a_planted_bug_breaks_the_claim(case, bug):
    assert case.run_with(bug).outcome == "counterexample"


@pytest.mark.parametrize("case", upset.CASES, ids=lambda case: case.size)
def test_each_register_that_turns_by_itself_is_found(case):
    """Each watched register is flipped and found. Nothing else shows that they are watched, as none flips in other
    tests."""
    assert {bug.name: case.run_with(bug).outcome for bug in case.bugs} == dict.fromkeys(
        (bug.name for bug in case.bugs), "counterexample"
    )


@pytest.mark.parametrize("claim", sorted({case.claim for case in CASES}))
def test_every_claim_has_a_bug(claim):
    assert any(case.bugs for case in CASES if case.claim == claim)


class Counter(wiring.Component):
    """Counts up to 5 and starts again."""

    def __init__(self):
        super().__init__({"enable": In(1), "count": Out(3)})

    def elaborate(self, platform):
        m = Module()
        with m.If(self.enable):
            m.d.sync += self.count.eq(self.count + 1)
            with m.If(self.count == 5):
                m.d.sync += self.count.eq(0)
        return m


def counts(proof, at_most=5, lemma=7):
    dut = Counter()
    proof.put(dut)
    proof.m.d.comb += dut.enable.eq(proof.free(1, "enable"))
    proof.claim(dut.count <= at_most)
    proof.lemma(dut.count <= lemma)


def test_what_holds_is_proved():
    assert prove(counts, 3).outcome == "proved"
    assert search(counts, 9).outcome == "proved"


def test_what_does_not_hold_has_a_counterexample_after_as_many_clocks_as_it_takes():
    verdict = search(lambda proof: counts(proof, at_most=4), 9)
    assert (verdict.outcome, verdict.clocks) == ("counterexample", 5)
    assert search(lambda proof: counts(proof, at_most=4), 5).outcome == "proved"


def test_a_false_lemma_is_no_proof_and_no_counterexample_to_the_claim():
    def build(proof):
        counts(proof, lemma=4)

    assert prove(build, 9).outcome == "counterexample"
    assert search(build, 9).outcome == "proved"


def test_what_no_induction_of_this_depth_reaches_is_open():
    def never_seven(proof):
        dut = Counter()
        proof.put(dut)
        proof.m.d.comb += dut.enable.eq(proof.free(1, "enable"))
        proof.claim(dut.count != 7)

    assert prove(never_seven, 1).outcome == "open"  # 7 follows 6; that nothing leads to 6 takes more clocks to see
    assert prove(never_seven, 4).outcome == "proved"


def turns(proof, at_most=5, rest=0):
    """The counter, never stopped, and at rest where it has the value ``rest``."""
    dut = Counter()
    proof.put(dut)
    proof.m.d.comb += dut.enable.eq(1)
    proof.claim(dut.count <= at_most)
    proof.rests(dut.count == rest)


@pytest.mark.parametrize("clocks", [0, 1, 2])
def test_from_rest_to_rest_is_forever(clocks):
    verdict = prove(turns, clocks)
    assert (verdict.outcome, verdict.clocks) == ("proved", clocks + 6)  # 0 comes again after 6 clocks


@pytest.mark.parametrize("clocks", [0, 1, 2])
def test_what_fails_between_two_rests_is_not_proved(clocks):
    assert prove(partial(turns, at_most=4), clocks).outcome != "proved"
    assert prove(partial(turns, at_most=3, rest=2), clocks).outcome != "proved"


def test_what_never_rests_is_open():
    verdict = prove(partial(turns, rest=6), 1)
    assert verdict.outcome == "open"
    assert verdict.said.startswith("no rest in 100 clocks")


def test_what_need_not_come_to_rest_again_is_open():
    def stops(proof):
        dut = Counter()
        proof.put(dut)
        proof.m.d.comb += dut.enable.eq(proof.free(1, "enable"))
        proof.claim(dut.count <= 5)
        proof.rests(dut.count == 0)

    verdict = prove(stops, 0)
    assert verdict.outcome == "open"
    assert verdict.said.startswith("no rest in 100 clocks")


def test_time_that_runs_out_is_open():
    verdict = prove(counts, 3, limit_s=0.01)
    assert verdict.outcome == "open"
    assert "no answer after" in verdict.said


def test_a_planted_bug_is_found_and_gone_afterwards():
    case = ProofCase("counts", "to 5", counts, 3)
    bug = Bug("one too far", Counter, "count", lambda count, inside: Mux(inside["count"] == 5, 6, count))
    assert case.run_with(bug).outcome == "counterexample"
    assert case.run().outcome == "proved"


class Bundles(wiring.Component):
    """A register of two fields, a wire, and two registers of one name."""

    def __init__(self):
        layout = data.StructLayout({"low": 2, "high": data.StructLayout({"first": 1, "second": 1})})
        super().__init__({"taken": In(layout), "kept": Out(layout), "sum": Out(3)})

    def elaborate(self, platform):
        m = Module()
        twice = [Signal(name="twice") for _ in range(2)]
        m.d.comb += self.sum.eq(self.kept.low + self.kept.high.first)
        m.d.sync += [self.kept.eq(self.taken), twice[0].eq(1), twice[1].eq(1)]
        return m


def takes(proof, wanted):
    """Claimed: ``wanted(before, dut)``, ``before`` being what was taken a clock ago."""
    dut = Bundles()
    proof.put(dut)
    proof.m.d.comb += dut.taken.eq(proof.free(4, "taken"))
    before = proof.before(dut.taken)
    with proof.m.If(proof.before(1)):
        proof.claim(wanted(before, dut))


@pytest.mark.parametrize(
    ("signal", "wrong", "holds"),
    [
        ("kept.high.second", lambda right, _: ~right, lambda before, dut: dut.kept.as_value() == before ^ 0b1000),
        ("kept.low", lambda right, inside: inside["kept.low"], lambda before, dut: dut.kept.low == 0),
        ("kept.low", lambda right, _: right + 1, lambda before, dut: dut.kept.low == (before[:2] + 1)[:2]),
        (
            "kept",
            lambda right, inside: inside.component.taken.low,
            lambda before, dut: dut.kept.as_value() == before[:2],
        ),
        ("sum", lambda right, _: right + 1, lambda before, dut: dut.sum == before[:2] + before[2] + 1),
    ],
)
def test_a_bug_changes_its_signal_and_nothing_else(signal, wrong, holds):
    """The claim is what the bug does: false without it, true with it."""

    def build(proof):
        takes(proof, holds)

    assert search(build, 5).outcome == "counterexample"
    assert search(build, 5, bug=Bug("wrong", Bundles, signal, wrong)).outcome == "proved"


@pytest.mark.parametrize(
    ("owner", "signal", "said"),
    [
        (Counter, "count", "wrong: there is no Counter in the design"),
        (Bundles, "keeps", "Bundles drives no signals that are called 'keeps', not one"),
        (Bundles, "taken", "Bundles drives no signals that are called 'taken', not one"),
        (Bundles, "twice", "Bundles drives 2 signals that are called 'twice', not one"),
        (Bundles, "kept.middle", "kept has no field that is called 'middle'"),
        (Bundles, "kept.low.first", "kept has no field that is called 'first'"),
    ],
)
def test_a_bug_that_names_what_is_not_there_is_refused(owner, signal, said):
    with pytest.raises(LookupError, match=said):
        search(
            lambda proof: takes(proof, lambda before, dut: 1), 2, bug=Bug("wrong", owner, signal, lambda right, _: 0)
        )


def test_a_bug_that_reads_what_is_not_there_is_refused():
    bug = Bug("wrong", Bundles, "sum", lambda right, inside: inside["carry"])
    with pytest.raises(LookupError, match="Bundles drives or reads no signals that are called 'carry'"):
        search(lambda proof: takes(proof, lambda before, dut: 1), 2, bug=bug)


@pytest.mark.slow  # other tests have these proofs and bugs one by one
def test_the_table(capsys):
    assert main(["framing, 4 clocks"]) == 0
    out = capsys.readouterr().out
    assert "proved            5 of 5" in out
    assert main(["no such claim"]) == 1
