"""Writes docs/verification.md from tests/claims.toml; with ``--results`` judges the claims by a run instead.

tests/claims.toml lists what is claimed and the tests that show it. A claim whose tests are missing, skipped or failed
in the run is an error. Only where it ``needs`` something that the machine lacks may they be skipped. A test says how
many cases it ran with ``record_property("cases", n)``; one that says nothing counts as one.
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

What is claimed, and the tests that show it. CI runs `make test-all` and fails when a test named here fails, is missing
or is skipped; `make test` runs a share of these tests that takes a few minutes. Where *command* is another one, it runs
more cases than `make test-all`. `make verification` writes this page from `tests/claims.toml`.

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


def page(claims: dict) -> str:
    """The page in Markdown."""
    text = HEAD
    for section in claims["section"]:
        text += f"## {section['title']}\n\n| claim | tests | command |\n|---|---|---|\n"
        for claim in section["claim"]:
            tests = "<br>".join(f"`{test}`" for test in claim["tests"])
            text += f"| {claim['claim']} | {tests} | `{claim.get('command', 'make test-all')}` |\n"
        text += "\n"
    text += "## Waived\n\n| claim | because |\n|---|---|\n"
    return text + "".join(f"| {waived['claim']} | {waived['because']} |\n" for waived in claims["waived"])


def judge(claims: dict, results: dict[str, Outcome]) -> tuple[list[str], list[str]]:
    """A line for each claim with the number of its cases, and what is wrong."""
    lines, wrong = [], []
    for section in claims["section"]:
        for claim in section["claim"]:
            outcomes = [outcome for test in claim["tests"] for outcome in matching(test, results)]
            lines.append(f"{sum(outcome.cases for outcome in outcomes):>12,}  {claim['claim']}")
            words = sorted({outcome.word() for outcome in outcomes} - {"passed"})
            if "needs" in claim:
                words = [word for word in words if not word.endswith("skipped")]
            wrong += [f"{claim['claim']}: {word} ({', '.join(claim['tests'])})" for word in words]
    return lines, wrong


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--results", type=Path, metavar="FILE", help="judge the claims by these results of pytest")
    args = parser.parse_args()
    claims = tomllib.loads((ROOT / "tests" / "claims.toml").read_text())
    if not args.results:
        PAGE.write_text(page(claims))
        print(f"wrote {PAGE.relative_to(ROOT)}")
        return 0
    lines, wrong = judge(claims, read_results(args.results))
    print("cases of each claim:", *lines, sep="\n")
    print(*wrong, sep="\n", file=sys.stderr)
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
