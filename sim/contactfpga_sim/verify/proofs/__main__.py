"""All proofs with their planted bugs, as a table: ``make formal``."""

import argparse
import sys
import time

from contactfpga.tools.console import interrupt
from contactfpga_sim.verify.proofs import (
    dual,
    label,
    label_serial,
    levels,
    link,
    pack,
    precharge,
    raster_guard,
    records,
    reports,
    reversal,
    reversal_frames,
    reversal_guard,
    reversal_reach,
    reversal_time,
    scan,
    self_test,
    several,
    streams,
    uart,
    units,
    upset,
    words,
)
from contactfpga_sim.verify.proofs.case import ProofCase

CASES: tuple[ProofCase, ...] = (
    *scan.CASES,
    *raster_guard.CASES,
    *levels.CASES,
    *precharge.CASES,
    *reversal.CASES,
    *reversal_frames.CASES,
    *reversal_guard.CASES,
    *reversal_reach.CASES,
    *reversal_time.CASES,
    *self_test.CASES,
    *label.CASES,
    *records.CASES,
    *label_serial.CASES,
    *streams.CASES,
    *pack.CASES,
    *words.CASES,
    *link.CASES,
    *reports.CASES,
    *uart.CASES,
    *several.CASES,
    *dual.CASES,
    *units.CASES,
    *upset.CASES,
)
_WIDTHS = (34, 32, 16, 8, 16, 10)


def main(arguments: list[str] | None = None) -> int:
    """Run all proofs, a line each; returns 1 if one fails or misses its bugs."""
    parser = argparse.ArgumentParser(prog="python -m contactfpga_sim.verify.proofs", description=__doc__)
    parser.add_argument("words", nargs="*", help="only proofs whose claim or size holds one of these")
    parser.add_argument("--quick", action="store_true", help="leave out what takes more than a minute")
    options = parser.parse_args(arguments)
    cases = [
        case
        for case in CASES
        if not (options.quick and case.campaign)
        and (not options.words or any(word in case.name for word in options.words))
    ]
    started = time.monotonic()
    _line("claim", "size", "holds", "seconds", "result", "bugs found")
    good = [_report(case, f"{number} of {len(cases)}") for number, case in enumerate(cases, 1)]
    print(f"{len(cases)} proofs in {time.monotonic() - started:.0f} s")
    return 0 if cases and all(good) else 1


def _report(case: ProofCase, number: str) -> bool:
    _progress(f"{number}: {case.name}")
    verdict = case.run()
    found = 0
    for bug in case.bugs:
        _progress(f"{number}: {case.name}: {bug.name}")
        found += case.run_with(bug).outcome == "counterexample"
    _progress("")
    holds = "forever" if not case.bounded else f"{case.clocks} clock{'s' if case.clocks > 1 else ''}"
    bugs = f"{found} of {len(case.bugs)}" if case.bugs else ""
    _line(case.claim, case.size, holds, f"{verdict.seconds:.1f}", verdict.outcome, bugs)
    return verdict.outcome == "proved" and found == len(case.bugs)


def _line(*fields: str) -> None:
    print("  ".join(f"{field:{width}}" for field, width in zip(fields, _WIDTHS)).rstrip(), flush=True)


def _progress(text: str) -> None:
    if sys.stderr.isatty():
        print(f"\r\x1b[K{text}", end="", file=sys.stderr, flush=True)


if __name__ == "__main__":
    interrupt.leave(interrupt.guarded(main))
