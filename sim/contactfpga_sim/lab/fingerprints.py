"""Fingerprints of a section's code: the set of definitions that it reaches."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import io
from collections.abc import Iterable

from contactfpga_sim.lab import reach
from contactfpga_sim.lab.registry import Study, StudyRun

LENGTH = 8


def fingerprint(study: Study, section: str) -> str:
    declared = study.sections[section]
    if declared.of_netlists:
        place = study.place(declared.makes)
        own = {one.mark for one in reach.reached([place]) if place.startswith(f"{one.module}:")}
        return _hashed({*own, *_netlists(study, section)})
    return _of(frozenset(study.place(name) for name in (declared.makes, study.compute) if name))


def _netlists(study: Study, section: str) -> list[str]:
    from contactfpga_sim.apps import size

    with size.keys_alone() as keys, contextlib.redirect_stderr(io.StringIO()):
        StudyRun(study).text(section)
    return keys


@functools.cache
def _of(places: frozenset[str]) -> str:
    return _hashed({one.mark for one in reach.reached(places)})


def _hashed(marks: Iterable[str]) -> str:
    return hashlib.sha256("\n".join(sorted(marks)).encode()).hexdigest()[:LENGTH]
