"""`make audit`: what a seed draws, and that what is wrong is seen."""

import dataclasses
import math

import audit
import pytest
from verification import Outcome

from contactfpga_sim.lab import writer
from contactfpga_sim.lab.studies import STUDIES
from contactfpga_sim.verify.mutants.campaign import Result
from contactfpga_sim.verify.mutants.netlist import Mutant

PASSED, FAILED, SKIPPED = Outcome(passed=2, cases=7), Outcome(passed=3, failed=1), Outcome(skipped=1)
CLAIM = {"claim": "it holds", "tests": ["test_a::*", "test_b::test_two"]}


@pytest.mark.parametrize(
    ("results", "said", "wrong"),
    [
        ({"test_a::test_one": PASSED, "test_b::test_two": PASSED}, "agrees, 14 cases", False),
        ({"test_a::test_one": PASSED, "test_b::test_two": SKIPPED}, "agrees, 7 cases; some tests were skipped", False),
        ({"test_a::test_one": FAILED, "test_b::test_two": PASSED}, "1 FAILED; passed", True),
        ({"test_a::test_one": PASSED}, "MISSING; passed", True),
    ],
)
def test_a_claim_is_judged_by_its_tests(results, said, wrong):
    assert audit.judged(CLAIM, results) == audit.Finding("it holds", said, wrong)


@pytest.fixture
def project(tmp_path, monkeypatch):
    """The pages and the files of their tables, to be changed."""
    docs = tmp_path / "docs"
    (docs / writer.FOLDER).mkdir(parents=True)
    for file in [*(audit.ROOT / "docs").glob("*.md"), *(audit.ROOT / "docs" / writer.FOLDER).iterdir()]:
        (docs / file.relative_to(audit.ROOT / "docs")).write_text(file.read_text())
    monkeypatch.setattr(audit, "ROOT", tmp_path)
    return docs


def test_a_table_that_is_not_what_it_would_be_today_is_seen(project):
    study = STUDIES["units"]
    assert not audit.table(study, "units", math.inf).wrong
    file = project / writer.FOLDER / "units-units.csv"
    file.write_text(file.read_text().replace("3.3 V,1 MHz,60 µs", "3.3 V,1 MHz,61 µs"))
    found = audit.table(study, "units", math.inf)
    assert (found.said, found.wrong) == ("differs", True)
    late = audit.table(study, "units", -math.inf)
    assert (late.said, late.wrong) == ("not looked at: 50 s were over", False)


def mutant_of(fate):
    """One with this fate."""
    mutant = Mutant(**{field.name: 0 if field.type == "int" else "x" for field in dataclasses.fields(Mutant)})
    return Result("8x8", mutant, fate)


@pytest.mark.parametrize(
    ("fate", "left", "wrong"), [("alive", 0, 0), ("alive", 4, 0), ("alive", 5, 5), ("open", 10, 0)]
)
def test_mutants_that_are_left_are_listed_and_more_than_four_are_wrong(monkeypatch, fate, left, wrong):
    monkeypatch.setattr(
        audit.campaign,
        "examine",
        lambda name, count, *_, **__: [mutant_of(fate)] * left + [mutant_of("killed")] * (count - left),
    )
    found = audit.mutants(audit.random.Random(1))
    assert sum(one.said.startswith("alive") for one in found) == left
    assert sum(one.wrong for one in found) == wrong
    assert sum(not one.ended for one in found) == left * (fate == "open")
    assert any("not proved in 100 s" in one.said for one in found) == (fate == "open")


@pytest.mark.parametrize("error", [audit.Contradiction, AssertionError])
def test_a_proof_or_a_board_that_contradicts_is_wrong(monkeypatch, error):
    def examine(*_, **__):
        raise error("it differs")

    monkeypatch.setattr(audit.campaign, "examine", examine)
    (found,) = audit.mutants(audit.random.Random(1))
    assert (found.said, found.wrong) == ("it differs", True)


@pytest.fixture
def tests(tmp_path, monkeypatch):
    """``tests(text)``: a project whose only tests are these, each claim's for some seconds."""

    def tests(text, seconds=200):
        (tmp_path / "tests").mkdir(exist_ok=True)
        (tmp_path / "tests" / "test_a.py").write_text(f"import time, subprocess\n\n\n{text}")
        (tmp_path / "pytest.ini").write_text("[pytest]\nmarkers =\n    campaign:\n")
        monkeypatch.setattr(audit, "ROOT", tmp_path)
        return audit.tried({"claim": "it holds", "tests": ["test_a::*"]}, seconds)

    return tests


GOOD, BAD = "def test_good():\n    pass\n\n\n", "def test_bad():\n    assert 0\n\n\n"


def test_claims_share_the_time_that_others_did_not_need(monkeypatch):
    monkeypatch.setattr(audit.time, "monotonic", lambda: 1000.0)
    assert audit.share(1150.0, cores=2, left=10) == 30
    assert audit.share(1140.0, cores=2, left=7) == 40
    assert [audit.share(1050.0, cores=2, left=left) for left in (2, 1)] == [50, 50]
    assert audit.share(990.0, cores=2, left=1) == 1


def test_a_claim_whose_tests_end_agrees_or_is_wrong(tests):
    assert tests(GOOD) == audit.Finding("it holds", "agrees, 1 cases")


def test_a_claim_whose_test_fails_is_wrong(tests):
    assert tests(GOOD + BAD) == audit.Finding("it holds", "1 FAILED; passed", wrong=True)


def test_a_claim_without_tests_is_wrong(tests):
    assert tests("") == audit.Finding("it holds", "MISSING", wrong=True)


def test_a_seed_decides_what_is_drawn_and_one_thing_that_is_wrong_the_status(monkeypatch, tmp_path, capsys):
    drawn = []
    monkeypatch.setattr(
        audit, "tried", lambda claim, limit_s: drawn.append(claim["claim"]) or audit.Finding(claim["claim"], "agrees")
    )
    monkeypatch.setattr(audit, "table", lambda study, name, until: audit.Finding(name, "agrees"))
    monkeypatch.setattr(audit, "mutants", lambda rng: [audit.Finding("mutant", "killed")])
    monkeypatch.setattr(audit, "PAGE", tmp_path / "build" / "audit.md")
    assert [audit.main(["--seed", seed]) for seed in ("1", "1", "2")] == [0, 0, 0]
    first, again, other = (sorted(drawn[start : start + 10]) for start in (0, 10, 20))
    assert first == again != other
    assert "Claims: 0 of 10 wrong, 0 not ended" in (tmp_path / "build" / "audit.md").read_text()
    monkeypatch.setattr(audit, "table", lambda study, name, until: audit.Finding(name, "differs", wrong=True))
    assert audit.main(["--seed", "1"]) == 1
    assert "Tables: 10 of 10 wrong" in capsys.readouterr().out


def test_results_of_a_run_of_all_tests_judge_the_claims(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(audit, "tried", lambda *_: pytest.fail("the tests ran already"))
    monkeypatch.setattr(audit, "table", lambda study, name, until: audit.Finding(name, "agrees"))
    monkeypatch.setattr(audit, "mutants", lambda rng: [audit.Finding("mutant", "killed")])
    monkeypatch.setattr(audit, "PAGE", tmp_path / "audit.md")
    (tmp_path / "tests.xml").write_text("<testsuite></testsuite>")
    assert audit.main(["--seed", "1", "--results", str(tmp_path / "tests.xml")]) == 1
    assert "Claims: 10 of 10 wrong" in capsys.readouterr().out
