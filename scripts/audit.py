"""``make audit SEED=n``: draws what the pages claim by a seed of yours, and looks whether it is so.

Ten claims of tests/claims.toml are drawn, and their tests run without those of the campaign. Ten tables of the pages
are drawn, of those of which a part takes seconds to make, and that part is made anew and compared with the page. Ten
mutants of the gateware of one Skin are drawn and simulated: stimuli that are compared with the golden model tell each
of them from the gateware, or a proof says that it changes nothing. The result is a page, build/audit.md. The status is
1 if a claim or a table does not hold, or if more mutants than :data:`ALIVE` are left.
"""

import argparse
import dataclasses
import os
import random
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterable, Sequence
from pathlib import Path

import verification

from contactfpga_sim.lab import beside, writer
from contactfpga_sim.lab.registry import Study, StudyRun
from contactfpga_sim.lab.studies import STUDIES
from contactfpga_sim.verify.mutants import campaign
from contactfpga_sim.verify.mutants.skins import SKINS

ROOT = verification.ROOT
PAGE = ROOT / "build" / "audit.md"
DRAWN = 10
"""Of claims, tables and mutants."""
ALIVE = 4
"""Mutants that may be left: some Skins leave one of ten that is neither told nor proved in so short a time, so five of
ten are left once in 600 audits."""
PROOF_S = 20
"""Seconds of each proof that four were too few for, on a machine with nothing else to do."""


@dataclasses.dataclass(frozen=True)
class Finding:
    """What was drawn, and whether it is so: ``agrees``, ``differs`` or why it was not looked at."""

    what: str
    said: str
    wrong: bool = False


def claims(rng: random.Random, run_before: Path | None) -> list[Finding]:
    """Claims, by their tests, or by the results of a run of all tests."""
    sections = tomllib.loads((ROOT / "tests" / "claims.toml").read_text())["section"]
    drawn = rng.sample([one for section in sections for one in section["claim"]], DRAWN)
    tests = [test for one in drawn for test in one["tests"]]
    results = run(tests) if run_before is None else verification.read_results(run_before)
    return [judged(one, results) for one in drawn]


def run(tests: Sequence[str]) -> dict[str, verification.Outcome]:
    """Outcomes of the tests with these names, ``file::name`` or ``file::*``."""
    files = {path.stem: path for path in (ROOT / "tests").rglob("test_*.py")}
    named = [(files[file], name) for file, name in (test.split("::") for test in tests)]
    nodes = [str(path) if name == "*" else f"{path}::{name}" for path, name in named]
    with tempfile.TemporaryDirectory() as folder:
        results = Path(folder) / "tests.xml"
        options = ["-q", "-n", "auto", "--dist", "loadfile", "-m", "not campaign", "--junitxml", str(results)]
        subprocess.run([sys.executable, "-m", "pytest", *options, *nodes], cwd=ROOT, stdin=subprocess.DEVNULL)
        return verification.read_results(results) if results.exists() else {}


def judged(claim: dict, results: dict[str, verification.Outcome]) -> Finding:
    """A claim by the outcomes of its tests."""
    outcomes = [one for test in claim["tests"] for one in verification.matching(test, results)]
    words = {one.word() for one in outcomes}
    if any("FAILED" in word or word == "MISSING" for word in words):
        return Finding(claim["claim"], "; ".join(sorted(words)), wrong=True)
    skipped = "" if words == {"passed"} else "; some tests were skipped"
    return Finding(claim["claim"], f"agrees, {sum(one.cases for one in outcomes):,} cases{skipped}")


def tables(rng: random.Random) -> list[Finding]:
    """Compare parts of tables with what their commands give today."""
    every = [(study, name) for study in STUDIES.values() for name, section in study.sections.items() if section.sample]
    return [table(study, name) for study, name in rng.sample(every, DRAWN)]


def table(study: Study, name: str) -> Finding:
    """A part of one table against its page."""
    page = study.page_of(name)
    what = f"docs/{page}, `{name}`"
    try:
        part = StudyRun(study).call(study.sections[name].sample)
    except ImportError as error:
        return Finding(what, f"not looked at: {error}")
    text = beside.whole(ROOT / "docs" / page, name)
    agrees = f"\n{part}\n" in f"\n{text}\n"
    return Finding(what, f"agrees, {len(part.splitlines())} lines" if agrees else "differs", wrong=not agrees)


def mutants(rng: random.Random) -> list[Finding]:
    """Changes of one Skin's netlist, by stimuli and proofs."""
    name = rng.choice(sorted(SKINS))
    found = campaign.examine(name, DRAWN, rng.randrange(1 << 30), long_s=PROOF_S)
    alive = [one for one in found if one.fate == "alive"]
    return [Finding(f"{one.mutant} ({name})", one.fate, one in alive and len(alive) > ALIVE) for one in found]


def page(seed: int, parts: dict[str, Sequence[Finding]]) -> str:
    """What agreed and what not, in Markdown."""
    text = f"# Audit by seed {seed}\n\n"
    for title, findings in parts.items():
        rows = [["what was drawn", "what came out"], *([one.what, one.said] for one in findings)]
        wrong = sum(one.wrong for one in findings)
        text += f"## {title}: {wrong} of {len(findings)} wrong\n\n{writer.table_of(rows)}\n\n"
    return text


def main(arguments: Iterable[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="make audit", description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, required=True, help="any whole number; it decides what is drawn")
    parser.add_argument("--results", type=Path, metavar="FILE", help="of pytest, to judge the claims by: runs no tests")
    given = parser.parse_args(arguments)
    seed, rng = given.seed, random.Random(given.seed)
    parts = {"Claims": claims(rng, given.results), "Tables": tables(rng), "Mutants": mutants(rng)}
    PAGE.parent.mkdir(exist_ok=True)
    PAGE.write_text(page(seed, parts))
    print(page(seed, parts), end="")
    return any(one.wrong for findings in parts.values() for one in findings)


if __name__ == "__main__":
    os.chdir(ROOT)
    sys.exit(main())
