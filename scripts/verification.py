"""Writes docs/verification.md and its list of claims from tests/claims.toml; with ``--results`` judges the claims by a
run instead.

tests/claims.toml lists what is claimed and the tests that show it. A claim whose tests are missing, skipped or failed
in the run is an error; with ``--drawn``, of a run that left tests out, missing ones are not judged. Only where a claim
``needs`` something that the machine lacks may its tests be skipped. A test says how many cases it ran with
``record_property("cases", n)``; one that says nothing counts as one.
"""

import argparse
import csv
import io
import itertools
import sys
import tomllib
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "verification.md"

CLAIMS = ROOT / "docs" / "tables" / "verification.csv"

HEAD = """# Verification

This page is for a reader who doubts a claim. It lists the tests of each claim, and the claims without tests.
[Status](status.md) shows which figures are compared with what.

## How to check a claim

- `make audit SEED=7` draws ten claims, ten tables of the pages and ten faults in the gateware by your number, checks
  each in some minutes and writes one page. It fails if one differs, and lists what did not end in its time.
- `make test` runs the quick tests, in minutes. `make test-all` runs tests of all claims. `make campaign` runs more
  cases of some of them, in hours.
- For one claim, look up its tests in the list. `test_scan::*` is every test of `test_scan.py`:

      python -m pytest tests/gateware/test_scan.py

CI runs every third case of each quick test of `make test-all`, and of each file's slow ones, which the commit draws. It
fails when a test of a claim fails or is skipped. Tests are skipped only where they need a tool that the machine lacks.

## Claims by subject

"""
FOOT = """
`make verification` writes this page and the list from `tests/claims.toml`.
"""


@dataclass
class Outcome:
    passed: int = 0
    skipped: int = 0
    failed: int = 0
    cases: int = 0

    def word(self) -> str:
        if self.failed:
            return f"{self.failed} FAILED"
        if self.skipped:
            return f"{self.skipped} skipped"
        return "passed" if self.passed else "MISSING"


def read_results(paths: Iterable[Path]) -> dict[str, Outcome]:
    """Outcome of every test function in these runs, by `file::name`, all its parameters together. Of a test that was in
    several runs the last one counts."""
    cases = itertools.chain.from_iterable(ElementTree.parse(path).iter("testcase") for path in paths)
    results: dict[str, Outcome] = {}
    for case in {(case.get("classname"), case.get("name")): case for case in cases}.values():
        if "icarus" in case.get("name", ""):
            continue  # a second simulator where it is installed; the page must not depend on that
        file = case.get("classname", "").split(".")[-1]
        outcome = results.setdefault(f"{file}::{case.get('name', '').split('[')[0]}", Outcome())
        kinds = {child.tag for child in case}
        if kinds & {"failure", "error"}:
            outcome.failed += 1
        elif "skipped" in kinds:
            outcome.skipped += 1
        else:
            outcome.passed += 1
            stated = [p.get("value", "") for p in case.iter("property") if p.get("name") == "cases"]
            outcome.cases += int(stated[0]) if stated else 1
    return results


def matching(test: str, results: dict[str, Outcome]) -> list[Outcome]:
    """Outcomes of a test, or with ``file::*`` of all tests in a file."""
    if test.endswith("::*"):
        found = [outcome for name, outcome in results.items() if name.startswith(test[:-1])]
        return found or [Outcome()]
    return [results.get(test, Outcome())]


def page(claims: dict) -> str:
    """The page in Markdown: how many claims a subject has, and what was not verified."""
    rows = [(section["title"], section["claim"]) for section in claims["section"]]
    text = HEAD + "| subject | claims | files of tests |\n|---|---|---|\n"
    for title, listed in rows:
        files = {test.split("::")[0] for claim in listed for test in claim["tests"]}
        text += f"| {title} | {len(listed)} | {len(files)} |\n"
    total = sum(len(listed) for _, listed in rows)
    text += f"\nThe list has [all {total} claims]({CLAIMS.parent.name}/{CLAIMS.name}), each with its tests.\n"
    text += "\n## Not verified\n\n| what | because |\n|---|---|\n"
    return text + "".join(f"| {waived['claim']} | {waived['because']} |\n" for waived in claims["waived"]) + FOOT


def listed_claims(claims: dict) -> str:
    """Each claim with its tests, the command that runs them all, and what a machine may lack for them: lines of a CSV
    file."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(("subject", "claim", "tests", "command", "needs"))
    for section in claims["section"]:
        for claim in section["claim"]:
            command = claim.get("command", "make test-all")
            rows.writerow((section["title"], claim["claim"], " ".join(claim["tests"]), command, claim.get("needs", "")))
    return text.getvalue()


def judge(claims: dict, results: dict[str, Outcome], drawn: bool = False) -> tuple[list[str], list[str]]:
    """A line for each claim with the number of its cases, and what is wrong. ``drawn``: the run left tests out."""
    lines, wrong = [], []
    for section in claims["section"]:
        for claim in section["claim"]:
            outcomes = [outcome for test in claim["tests"] for outcome in matching(test, results)]
            lines.append(f"{sum(outcome.cases for outcome in outcomes):>12,}  {claim['claim']}")
            words = sorted({outcome.word() for outcome in outcomes} - {"passed", "MISSING" if drawn else "passed"})
            if "needs" in claim:
                words = [word for word in words if not word.endswith("skipped")]
            wrong += [f"{claim['claim']}: {word} ({', '.join(claim['tests'])})" for word in words]
    return lines, wrong


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--results", type=Path, nargs="+", metavar="FILE", help="judge the claims by these results of pytest"
    )
    parser.add_argument("--drawn", action="store_true", help="the run left tests out, which are not judged")
    args = parser.parse_args()
    claims = tomllib.loads((ROOT / "tests" / "claims.toml").read_text())
    if not args.results:
        PAGE.write_text(page(claims))
        CLAIMS.write_text(listed_claims(claims))
        print(f"wrote {PAGE.relative_to(ROOT)} and {CLAIMS.relative_to(ROOT)}")
        return 0
    lines, wrong = judge(claims, read_results(args.results), args.drawn)
    print("cases of each claim:", *lines, sep="\n")
    print(*wrong, sep="\n", file=sys.stderr)
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
