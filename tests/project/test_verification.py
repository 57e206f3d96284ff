"""The page of claims: written from tests/claims.toml, about tests that exist, judged by what a run says of them."""

import ast
import csv
import itertools
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import verification

ROOT = Path(__file__).resolve().parents[2]
CLAIMS = tomllib.loads((ROOT / "tests" / "claims.toml").read_text(encoding="utf-8"))
NAMED = sorted({test for section in CLAIMS["section"] for claim in section["claim"] for test in claim["tests"]})


def test_the_page_is_written_from_the_claims():
    assert verification.PAGE.read_text(encoding="utf-8") == verification.page(CLAIMS)
    assert verification.CLAIMS.read_text(encoding="utf-8") == verification.listed_claims(CLAIMS)


def test_the_list_has_each_claim_with_all_its_tests():
    rows = list(csv.DictReader(verification.CLAIMS.read_text(encoding="utf-8").splitlines()))
    claims = [claim for section in CLAIMS["section"] for claim in section["claim"]]
    assert [(row["claim"], row["tests"].split()) for row in rows] == [(one["claim"], one["tests"]) for one in claims]
    assert f"[all {len(rows)} claims](tables/verification.csv)" in verification.PAGE.read_text(encoding="utf-8")


def test_each_test_that_a_claim_names_exists():
    files = {path.stem: path for path in (ROOT / "tests").rglob("test_*.py")}
    assert NAMED
    for file, tests in itertools.groupby(NAMED, lambda test: test.partition("::")[0]):
        nodes = ast.walk(ast.parse(files[file].read_text("utf-8")))
        defined = {"*"} | {node.name for node in nodes if isinstance(node, ast.FunctionDef)}
        for test in tests:
            assert test.partition("::")[2] in defined, test


CASE = '<testcase classname="tests.a.test_a" name="test_it[{}]">{}</testcase>'


@pytest.mark.parametrize(
    ("cases", "needs", "said"),
    [
        ([""], None, None),
        (["", "<failure/>"], None, "it works: 1 FAILED"),
        (["", "<failure/>"], "a tool", "it works: 1 FAILED"),
        (["", "<skipped/>"], None, "it works: 1 skipped"),
        (["", "<skipped/>"], "a tool", None),
        ([], None, "it works: MISSING"),
        ([], "a tool", "it works: MISSING"),
    ],
)
def test_a_claim_stands_or_falls_with_its_tests(tmp_path, cases, needs, said):
    results = tmp_path / "tests.xml"
    results.write_text(f"<testsuite>{''.join(CASE.format(n, case) for n, case in enumerate(cases))}</testsuite>")
    claim = {"claim": "it works", "tests": ["test_a::test_it"]} | ({"needs": needs} if needs else {})
    lines, wrong = verification.judge({"section": [{"claim": [claim]}]}, verification.read_results([results]))
    assert [line.partition(" (")[0] for line in wrong] == ([said] if said else [])
    assert len(lines) == 1
    drawn = verification.judge({"section": [{"claim": [claim]}]}, verification.read_results([results]), drawn=True)[1]
    assert drawn == ([] if said and "MISSING" in said else wrong)


def test_cases_are_counted(tmp_path):
    results = tmp_path / "tests.xml"
    four = '<properties><property name="cases" value="4"/></properties>'
    results.write_text(f"<testsuite>{CASE.format(1, four)}{CASE.format(2, '')}</testsuite>")
    assert verification.read_results([results])["test_a::test_it"].cases == 5


def test_a_claim_may_have_its_tests_in_two_runs(tmp_path):
    """The second run has a test that the first one skipped, and not the one that passed."""
    runs = {"quick.xml": CASE.format(1, "") + CASE.format(2, "<skipped/>"), "tests.xml": CASE.format(2, "")}
    for name, cases in runs.items():
        (tmp_path / name).write_text(f"<testsuite>{cases}</testsuite>")
    files = [tmp_path / name for name in runs]
    assert verification.read_results(files)["test_a::test_it"] == verification.Outcome(passed=2, cases=2)


def test_a_run_without_the_tests_fails(tmp_path):
    empty = tmp_path / "tests.xml"
    empty.write_text("<testsuite/>")
    done = subprocess.run([sys.executable, verification.__file__, "--results", empty], capture_output=True, text=True)
    assert done.returncode == 1
    assert "MISSING" in done.stderr
