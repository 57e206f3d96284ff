"""``make audit SEED=n``: draws what the pages claim by a seed of yours, and looks whether it is so, in five minutes.

Ten claims of tests/claims.toml are drawn, and their tests run without those of the campaign. Ten tables of the pages
are drawn, of those of which a part takes seconds to make, and that part is made anew and compared with the page. Ten
mutants of the gateware of one Skin are drawn and simulated: stimuli that are compared with the golden model tell each
of them from the gateware, or a proof says that it changes nothing. The result is a page, build/audit.md.

What did not end in its time is listed as such: it neither agrees nor differs. The status is 1 if a claim or a table
does not hold, if the gateware differs from the golden model, if a proof contradicts a simulation, or if more mutants
than :data:`ALIVE` are left though all was tried in time.
"""

import argparse
import dataclasses
import itertools
import os
import random
import re
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import verification

from contactfpga_sim.lab import writer
from contactfpga_sim.lab.registry import Study, StudyRun
from contactfpga_sim.lab.studies import STUDIES
from contactfpga_sim.verify.mutants import campaign
from contactfpga_sim.verify.mutants.proof import Contradiction
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
CLAIMS_S, TABLES_S, MUTANTS_S = 150, 50, 100
"""Seconds for the tests of all claims, one claim a core at a time; after which no table and nothing of mutants
begins."""


@dataclasses.dataclass(frozen=True)
class Finding:
    """What was drawn, and whether it is so: ``agrees``, ``differs`` or why it was not looked at."""

    what: str
    said: str
    wrong: bool = False
    ended: bool = True
    """False: time was too short to say."""


def claims(rng: random.Random, runs_before: Sequence[Path]) -> list[Finding]:
    """Claims, by their tests, or by the results of runs that together had all tests."""
    sections = tomllib.loads((ROOT / "tests" / "claims.toml").read_text())["section"]
    drawn = rng.sample([one for section in sections for one in section["claim"]], DRAWN)
    if runs_before:
        results = verification.read_results(runs_before)
        return [judged(one, results) for one in drawn]
    cores, until = os.cpu_count() or 1, time.monotonic() + CLAIMS_S
    with ThreadPoolExecutor(cores) as pool:
        return list(pool.map(lambda place: tried(drawn[place], share(until, cores, DRAWN - place)), range(DRAWN)))


def share(until: float, cores: int, left: int) -> int:
    """Seconds for the next of ``left`` claims: they share the time that earlier ones did not need."""
    return max(1, round((until - time.monotonic()) * min(1, cores / left)))


def tried(claim: dict, limit_s: int) -> Finding:
    """Judge a claim by those of its tests that end within ``limit_s`` seconds."""
    files = {path.stem: path for path in (ROOT / "tests").rglob("test_*.py")}
    named = [(files[file], name) for file, name in (test.split("::") for test in claim["tests"])]
    nodes = [str(path) if name == "*" else f"{path}::{name}" for path, name in named]
    with tempfile.TemporaryDirectory() as folder:
        results, said = Path(folder) / "tests.xml", Path(folder) / "said.txt"
        options = ["-v", "-n", "0", "-p", "no:cacheprovider", "-m", "not campaign", "--junitxml", str(results)]
        if run([sys.executable, "-u", "-m", "pytest", *options, *nodes], said, limit_s):
            return judged(claim, verification.read_results([results]) if results.exists() else {})
        ended = re.findall(r"^\S+::.* (PASSED|FAILED|ERROR)\b", said.read_text(), re.MULTILINE)
    passed = ended.count("PASSED")
    if failed := len(ended) - passed:
        return Finding(claim["claim"], f"{failed} FAILED; not ended in {limit_s} s", wrong=True, ended=False)
    return Finding(claim["claim"], f"not ended in {limit_s} s; {passed:,} tests passed until then", ended=False)


def run(command: Sequence[str], said: Path, limit_s: int) -> bool:
    """Whether a command ends within ``limit_s`` seconds; otherwise it is killed with its children. Its output goes into
    the file ``said``."""
    with said.open("w") as out:
        process = subprocess.Popen(
            command, cwd=ROOT, stdin=subprocess.DEVNULL, stdout=out, stderr=out, start_new_session=True
        )
    try:
        process.wait(limit_s)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        return False
    return True


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
    until = time.monotonic() + TABLES_S
    return [table(study, name, until) for study, name in rng.sample(every, DRAWN)]


def table(study: Study, name: str, until: float) -> Finding:
    """A part of one table against its page, unless it is later than ``until``."""
    page = study.page_of(name)
    what = f"docs/{page}, `{name}`"
    if time.monotonic() >= until:
        return Finding(what, f"not looked at: {TABLES_S} s were over", ended=False)
    try:
        part = StudyRun(study).sampled(name)
    except ImportError as error:
        return Finding(what, f"not looked at: {error}")
    text = writer.whole(ROOT / "docs" / page, name)
    agrees = f"\n{part}\n" in f"\n{text}\n"
    return Finding(what, f"agrees, {len(part.splitlines())} lines" if agrees else "differs", wrong=not agrees)


def mutants(rng: random.Random) -> list[Finding]:
    """Changes of one Skin's netlist, by stimuli and proofs."""
    name = rng.choice(sorted(SKINS))
    try:
        found = campaign.examine(name, DRAWN, rng.randrange(1 << 30), long_s=PROOF_S, budget_s=MUTANTS_S)
    except (Contradiction, AssertionError) as error:  # a mismatch is one of these
        return [Finding(f"mutants of {name}", str(error), wrong=True)]
    alive = [one for one in found if one.fate == "alive"]
    said = {"open": f"alive, not proved in {MUTANTS_S} s"}
    return [
        Finding(
            f"{one.mutant} ({name})",
            said.get(one.fate, one.fate),
            wrong=one in alive and len(alive) > ALIVE,
            ended=one.fate != "open",
        )
        for one in found
    ]


def page(seed: int, parts: dict[str, Sequence[Finding]], seconds: Sequence[float]) -> str:
    """What agreed and what not, in Markdown, and how many seconds each part took."""
    text = f"# Audit by seed {seed}\n\n"
    for (title, findings), took in zip(parts.items(), seconds, strict=True):
        rows = [["what was drawn", "what came out"], *([one.what, one.said] for one in findings)]
        wrong, left = (sum(flags) for flags in zip(*((one.wrong, not one.ended) for one in findings), strict=True))
        text += f"## {title}: {wrong} of {len(findings)} wrong, {left} not ended, {took:.0f} s\n\n"
        text += f"{writer.table_of(rows)}\n\n"
    return text


def main(arguments: Iterable[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="make audit", description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, required=True, help="any whole number; it decides what is drawn")
    text = "of pytest, to judge the claims by: runs no tests"
    parser.add_argument("--results", type=Path, nargs="+", default=(), metavar="FILE", help=text)
    given = parser.parse_args(arguments)
    seed, rng = given.seed, random.Random(given.seed)
    times = [time.monotonic()]
    parts: dict[str, list[Finding]] = {}
    for title, look in (
        ("Claims", lambda: claims(rng, given.results)),
        ("Tables", lambda: tables(rng)),
        ("Mutants", lambda: mutants(rng)),
    ):
        parts[title] = look()
        times.append(time.monotonic())
    text = page(seed, parts, [late - early for early, late in itertools.pairwise(times)])
    PAGE.parent.mkdir(exist_ok=True)
    PAGE.write_text(text)
    print(text, end="")
    return any(one.wrong for findings in parts.values() for one in findings)


if __name__ == "__main__":
    os.chdir(ROOT)
    sys.exit(main())
