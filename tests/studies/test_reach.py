"""A fingerprint holds all that runs while a section is made. A definition that runs and that is not found by name would
let a page grow old in silence."""

import sys
from pathlib import Path

import pytest
from study_pages import DOCS

from contactfpga_sim.lab import reach
from contactfpga_sim.lab.registry import StudyRun
from contactfpga_sim.lab.studies import STUDIES

TOPS = [DOCS.parent / name for name in ("hdl", "py", "sim")]
SAMPLED = {"closed closed", "haptics layouts", "kits parts", "performance bridges", "several several_line"}
"""Samples through gateware, golden model, driver, haptics and covers."""


def within_an_import(frame, test):
    while frame is not test and frame.f_code.co_name != "<module>":
        frame = frame.f_back
    return frame is not test


def place(code):
    """Module and outermost name of a function, with its class; None of code that is not the project's."""
    top = next((top for top in TOPS if Path(code.co_filename).is_relative_to(top)), None)
    # The body of a class runs where the class is defined; a lambda outside of functions belongs to a variable.
    if top is None or not code.co_flags & 1 or code.co_qualname == "<lambda>":
        return None
    module = ".".join(Path(code.co_filename).relative_to(top).with_suffix("").parts)
    return module.removesuffix(".__init__"), code.co_qualname.partition(".<")[0]


@pytest.mark.parametrize("sampled", sorted(SAMPLED))
def test_all_that_runs_is_found_by_name(sampled):
    name, _, section = sampled.partition(" ")
    study, ran = STUDIES[name], set()
    declared = study.sections[section]
    test = sys._getframe()

    def called(frame, event, _):
        if event == "call" and frame.f_code not in ran and not within_an_import(frame, test):
            ran.add(frame.f_code)

    sys.setprofile(called)
    try:
        StudyRun(study).sampled(section)
    finally:
        sys.setprofile(None)
    places = {place(code) for code in ran} - {None}
    places = {one for one in places if not one[0].startswith("contactfpga_sim.lab.registry")}
    found = reach.reached(study.place(one) for one in (declared.sample, declared.makes, study.compute) if one)
    assert len(places) > 20
    assert places <= {(one.module, one.name) for one in found} | {("contactfpga_sim.lab.writer", "spelled")}


CODE = """
import functools, json
from {0}.below import *
from {0}.below import given as taken
from {0} import below

class Base(json.JSONEncoder):
    def default(self, one):
        return self.hook() + below.far()

class Below(Base):
    def hook(self):
        return near()
    def unused(self):
        return other()

def near(): return taken() + starred()
def other(): return 5
def decorated(): return {{"x": LATER}}
LATER = "{0}.below:by_name"
if LATER:
    def near_too(): return 1
def root(): return Below().encode(decorated()) + str(near_too())
"""
BELOW = """
print
def given(): return 1
def starred(): return 2
def far(): return 3
def by_name(): return 4
def not_reached(): return 5
"""


def test_what_a_name_may_lead_to(tmp_path, monkeypatch):
    package = "contactfpga_reach"
    (tmp_path / package).mkdir()
    for name, text in (("__init__", ""), ("code", CODE.format(package)), ("below", BELOW)):
        (tmp_path / package / f"{name}.py").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    found = {f"{one.module.rpartition('.')[2]}:{one.name}" for one in reach.reached([f"{package}.code:root"])}
    assert {"code:near_too", "below:by_name", "below:given", "below:starred", "below:far"} <= found
    assert {"code:Below.hook", "code:Base.default", "code:near", "code:LATER"} <= found
    assert not found & {"below:not_reached", "code:other", "code:Below.unused"}
