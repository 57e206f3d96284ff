"""Writes docs/verification.md from the results of `make test`, or checks that it still holds.

tests/claims.toml lists what is claimed and the tests that show it. A claim whose tests are missing, skipped or failed
is an error; only those marked `recordings`, `icarus` or `ngspice` may be skipped, where these are absent. A test says
how many cases it ran with `record_property("cases", n)`; one that says nothing counts as one.
"""

import argparse
import sys
import tomllib
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "verification.md"

HEAD = """# Verification

Written by `make verification` from the results of `make test`; CI fails when a line's tests are missing or skipped, or
when this page is out of date. Only the recordings, Icarus Verilog and ngspice may be absent. *Cases* counts frames,
patterns or inputs where a test runs many of them. Where *command* is not `make test`, it runs more than the share
counted here.

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


def read_results(path: Path) -> dict[str, Outcome]:
    """Outcome of every test function, by `file::name`, all its parameters together."""
    results: dict[str, Outcome] = {}
    for case in ElementTree.parse(path).iter("testcase"):
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


def judge(claims: dict, results: dict[str, Outcome]) -> tuple[str, list[str], set[str]]:
    """The page, what is wrong, and the lines that may differ because something is absent."""
    page, wrong, loose = HEAD, [], set()
    for section in claims["section"]:
        page += f"## {section['title']}\n\n| claim | tests | command | cases | result |\n|---|---|---|---|---|\n"
        for claim in section["claim"]:
            outcomes = [outcome for test in claim["tests"] for outcome in matching(test, results)]
            words = sorted({outcome.word() for outcome in outcomes})
            cases = sum(outcome.cases for outcome in outcomes)
            tests = "<br>".join(f"`{test}`" for test in claim["tests"])
            command = claim.get("command", "make test")
            page += f"| {claim['claim']} | {tests} | `{command}` | {cases:,} | {', '.join(words)} |\n"
            if any(claim.get(name) for name in ("recordings", "icarus", "ngspice")):
                loose.add(claim["claim"])
                words = [word for word in words if "skipped" not in word]
            wrong += [f"{claim['claim']}: {word} ({', '.join(claim['tests'])})" for word in words if word != "passed"]
        page += "\n"
    page += "## Waived\n\n| claim | because |\n|---|---|\n"
    page += "".join(f"| {waived['claim']} | {waived['because']} |\n" for waived in claims["waived"])
    return page, wrong, loose


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing; fail if the page is out of date")
    parser.add_argument("--results", type=Path, default=ROOT / "build" / "tests.xml")
    args = parser.parse_args()
    claims = tomllib.loads((ROOT / "tests" / "claims.toml").read_text())
    page, wrong, loose = judge(claims, read_results(args.results))
    if args.check:
        old, new = PAGE.read_text().splitlines(), page.splitlines()
        stale = [line for line in new if line not in old and line.split("|")[1:2] not in [[f" {c} "] for c in loose]]
        wrong += [f"docs/verification.md is out of date (make verification): {line}" for line in stale]
    else:
        PAGE.write_text(page)
        print(f"wrote {PAGE.relative_to(ROOT)}")
    for line in wrong:
        print(line, file=sys.stderr)
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
