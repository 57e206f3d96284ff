"""The proofs hold, find the bugs planted for them, and the machinery around them can say no."""

import pytest
from amaranth.hdl import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from contactfpga_sim.proofs.__main__ import CASES, main
from contactfpga_sim.proofs.bugs import Bug, planted
from contactfpga_sim.proofs.case import Case
from contactfpga_sim.proofs.solve import prove, search

LONG_S = 7000


def _cases_with_marks():
    for case in CASES:
        yield pytest.param(case, id=case.name, marks=[pytest.mark.campaign] if case.campaign else [])


def _bugs_with_marks():
    for case in CASES:
        for bug in case.bugs:
            marks = [pytest.mark.campaign] if case.campaign or bug is not case.bugs[0] else []
            yield pytest.param(case, bug, id=f"{case.name}: {bug.name}", marks=marks)


@pytest.mark.parametrize("case", list(_cases_with_marks()))
def test_the_claim_holds(case):
    verdict = case.run(limit_s=LONG_S if case.campaign else 200)
    assert verdict.outcome == "proved", verdict.said[-5000:]


@pytest.mark.parametrize(("case", "bug"), list(_bugs_with_marks()))
def test_a_planted_bug_breaks_the_claim(case, bug):
    assert case.run_with(bug).outcome == "counterexample"


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


def test_time_that_runs_out_is_open():
    verdict = prove(counts, 3, limit_s=0.01)
    assert verdict.outcome == "open"
    assert "no answer after" in verdict.said


def test_a_planted_bug_is_found_and_gone_afterwards():
    case = Case("counts", "to 5", counts, 3)
    bug = Bug("one too far", Counter, "elaborate", "== 5", "== 6")
    assert case.run_with(bug).outcome == "counterexample"
    assert case.run().outcome == "proved"


@pytest.mark.parametrize(("old", "times"), [("== 4", 0), ("m.If", 2)])
def test_a_bug_that_fits_nowhere_or_twice_is_refused(old, times):
    with pytest.raises(ValueError, match=f"'{old}' occurs {times} times in Counter.elaborate, not once"):
        with planted(Bug("none", Counter, "elaborate", old, "")):
            pass


def test_the_table(capsys):
    assert main(["framing, 4 clocks"]) == 0
    out = capsys.readouterr().out
    assert "proved            5 of 5" in out
    assert main(["no such claim"]) == 1
