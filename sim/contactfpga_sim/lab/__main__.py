"""Make the pages' tables and pictures: ``python -m contactfpga_sim.lab NAME``, or ``--all``."""

from __future__ import annotations

import argparse
import contextlib
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

from contactfpga.errors import ContactFPGAError, MissingExtra
from contactfpga.tools.console import flags, interrupt, numbers, outputs
from contactfpga_sim.apps import pool
from contactfpga_sim.lab import fingerprints, studies, writer
from contactfpga_sim.lab.registry import Study, StudyRun

DOCS = Path("docs")
QUICK_MINUTES = 2


class StudyError(ContactFPGAError):
    """A study cannot be made here."""


def lacking(needs: Iterable[str]) -> list[str]:
    return [one for one in needs if not (Path(one).exists() if "/" in one else shutil.which(one))]


def make(study: Study) -> None:
    """Write a study's sections and pictures. Raises :class:`StudyError`, :class:`MissingExtra`."""
    if absent := lacking(study.needs):
        raise StudyError(f"{study.name} needs {', '.join(absent)}")
    for name in {study.page_of(section) for section in study.sections}:
        writer.page(DOCS / name)
    images = outputs.folder(DOCS / "images", "the folder of the pictures")
    try:
        _make(study, StudyRun(study), images)
    except ImportError as error:
        if isinstance(error, ContactFPGAError) or (error.name or "").startswith("contactfpga"):
            raise
        raise MissingExtra(study.name, study.extra) from error


def _make(study: Study, run: StudyRun, images: Path) -> None:
    for name, section in study.sections.items():
        page = study.page_of(name)
        if absent := lacking(section.needs):
            print(f"{page}: {name} stays as it is without {', '.join(absent)}", flush=True)
            continue
        made = run.made(name)
        file = DOCS / writer.FOLDER / f"{Path(page).stem}-{name}.csv"
        text = made.on_page(file) if isinstance(made, writer.Table) else writer.spelled(made)
        writer.write(DOCS / page, {name: lambda text=text: text}, fingerprints.fingerprint(study, name))  # type: ignore[misc]
        print(f"{page}: {name}", flush=True)
    if study.pictures:
        drawn = run.call(study.pictures, images)
        for path in [drawn] if isinstance(drawn, Path) else drawn:
            print(f"drew {path}", flush=True)


def stale(study: Study) -> Iterator[str]:
    """A line per section with an outdated fingerprint."""
    for name in study.sections:
        page = study.page_of(name)
        written = writer.sections((DOCS / page).read_text(encoding="utf-8"))[name]
        if written.fingerprint != fingerprints.fingerprint(study, name):
            yield f"{page}: {name}: make pages NAME={study.name}"


def listed(study: Study) -> str:
    needs = f"; needs {', '.join(study.needs)}" if study.needs else ""
    needs += "; made apart" if study.apart else ""
    return f"{study.name:<12} {study.page:<16} {study.minutes:>4g} min  {study.title}{needs}"


def main() -> int:
    args = _parser().parse_args()
    names = flags.known("study", args.name, list(studies.STUDIES))
    chosen = [studies.STUDIES[name] for name in names]
    if args.quick:
        chosen = [study for study in chosen if study.minutes <= QUICK_MINUTES]
    if args.list:
        print(*map(listed, chosen), sep="\n")
        return 0
    if not DOCS.is_dir():
        raise StudyError("there is no folder 'docs' here; run this in the folder of the sources")
    if args.stale:
        print(*(line for study in chosen for line in stale(study)), sep="\n")
        return 0
    if args.check:
        if late := [line for study in chosen if not study.apart for line in stale(study)]:
            raise StudyError("; ".join(["pages are out of date", *late]))
        return 0
    if not (args.name or args.all):
        raise StudyError("name a study, or give --all or --list")
    if not args.name:
        chosen = [study for study in chosen if not study.apart]
    with _settings(args):
        return _make_all(chosen, strict=bool(args.name))


def _make_all(chosen: Iterable[Study], strict: bool) -> int:
    for study in chosen:
        begun = time.monotonic()
        try:
            make(study)
            _judge(study, (time.monotonic() - begun) / 60)
        except (StudyError, MissingExtra) as error:
            if strict:
                raise
            print(f"left out: {error}", file=sys.stderr, flush=True)
    return 0


def _judge(study: Study, minutes: float) -> None:
    if minutes > study.minutes:
        print(f"{study.name} took {minutes:.1f} minutes; its limit on two cores is {study.minutes:g}", file=sys.stderr)


@contextlib.contextmanager
def _settings(args: argparse.Namespace) -> Iterator[None]:
    with contextlib.ExitStack() as stack:
        stack.callback(setattr, pool, "usual_jobs", pool.usual_jobs)
        pool.usual_jobs = args.jobs
        if args.fresh:
            os.environ["CONTACTFPGA_CACHE"] = stack.enter_context(tempfile.TemporaryDirectory(prefix="contactfpga-"))
        yield


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m contactfpga_sim.lab", description="Make tables and pictures of the pages anew."
    )
    parser.add_argument("name", nargs="*", help="Study to make; --list shows them.")
    parser.add_argument("--all", action="store_true", help="Make all that can be made here, but those made apart.")
    parser.add_argument("--list", action="store_true", help="List the studies, and make none.")
    parser.add_argument("--stale", action="store_true", help="List the sections that are out of date, and make none.")
    parser.add_argument("--check", action="store_true", help="Refuse outdated sections, but those made apart.")
    parser.add_argument("--quick", action="store_true", help=f"Only those of at most {QUICK_MINUTES} minutes.")
    parser.add_argument("--fresh", action="store_true", help="Take no result that was kept from before.")
    parser.add_argument("--jobs", type=numbers.JOBS, metavar="N", help="Processes to use (default: one per core).")
    return parser


if __name__ == "__main__":
    interrupt.leave(interrupt.guarded(main))
