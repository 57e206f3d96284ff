"""`make audit`: what a seed draws, and that what is wrong is seen."""

import dataclasses

import audit
import pytest
from verification import Outcome

from contactfpga_sim.lab import beside
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
    (docs / beside.FOLDER).mkdir(parents=True)
    for file in [*(audit.ROOT / "docs").glob("*.md"), *(audit.ROOT / "docs" / beside.FOLDER).iterdir()]:
        (docs / file.relative_to(audit.ROOT / "docs")).write_text(file.read_text())
    monkeypatch.setattr(audit, "ROOT", tmp_path)
    return docs


def test_a_table_that_is_not_what_it_would_be_today_is_seen(project):
    study = STUDIES["units"]
    assert not audit.table(study, "units").wrong
    file = project / beside.FOLDER / "units-units.csv"
    file.write_text(file.read_text().replace("3.3 V,1 MHz,60 µs", "3.3 V,1 MHz,61 µs"))
    found = audit.table(study, "units")
    assert (found.said, found.wrong) == ("differs", True)


@pytest.mark.parametrize(("alive", "wrong"), [(0, 0), (4, 0), (5, 5)])
def test_mutants_that_are_left_are_listed_and_more_than_four_are_wrong(monkeypatch, alive, wrong):
    def examine(name, count, seed, long_s):
        fates = ["alive"] * alive + ["killed"] * (count - alive)
        mutant = Mutant(**{field.name: 0 if field.type == "int" else "x" for field in dataclasses.fields(Mutant)})
        return [Result(name, mutant, fate) for fate in fates]

    monkeypatch.setattr(audit.campaign, "examine", examine)
    found = audit.mutants(audit.random.Random(1))
    assert [one.said for one in found].count("alive") == alive
    assert sum(one.wrong for one in found) == wrong


def test_a_seed_decides_what_is_drawn_and_one_thing_that_is_wrong_the_status(monkeypatch, tmp_path, capsys):
    drawn = []
    monkeypatch.setattr(audit, "run", lambda tests: drawn.append(tests) or dict.fromkeys(tests, PASSED))
    monkeypatch.setattr(audit, "judged", lambda claim, results: audit.Finding(claim["claim"], "agrees"))
    monkeypatch.setattr(audit, "table", lambda study, name: audit.Finding(name, "agrees"))
    monkeypatch.setattr(audit, "mutants", lambda rng: [audit.Finding("mutant", "killed")])
    monkeypatch.setattr(audit, "PAGE", tmp_path / "build" / "audit.md")
    assert [audit.main(["--seed", seed]) for seed in ("1", "1", "2")] == [0, 0, 0]
    assert drawn[0] == drawn[1] != drawn[2]
    assert "Claims: 0 of 10 wrong" in (tmp_path / "build" / "audit.md").read_text()
    monkeypatch.setattr(audit, "table", lambda study, name: audit.Finding(name, "differs", wrong=True))
    assert audit.main(["--seed", "1"]) == 1
    assert "Tables: 10 of 10 wrong" in capsys.readouterr().out


def test_results_of_a_run_of_all_tests_judge_the_claims(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(audit, "run", lambda tests: pytest.fail("the tests ran already"))
    monkeypatch.setattr(audit, "table", lambda study, name: audit.Finding(name, "agrees"))
    monkeypatch.setattr(audit, "mutants", lambda rng: [audit.Finding("mutant", "killed")])
    monkeypatch.setattr(audit, "PAGE", tmp_path / "audit.md")
    (tmp_path / "tests.xml").write_text("<testsuite></testsuite>")
    assert audit.main(["--seed", "1", "--results", str(tmp_path / "tests.xml")]) == 1
    assert "Claims: 10 of 10 wrong" in capsys.readouterr().out


def test_each_claim_names_tests_that_are_there():
    files = {path.stem for path in (audit.ROOT / "tests").rglob("test_*.py")}
    sections = audit.tomllib.loads((audit.ROOT / "tests" / "claims.toml").read_text())["section"]
    assert {test.split("::")[0] for part in sections for claim in part["claim"] for test in claim["tests"]} <= files
