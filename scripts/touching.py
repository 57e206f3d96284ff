"""A pytest plugin that notes which functions of the gateware each test runs, and how long the test takes.

The copy of the gateware that :func:`tested_mutants.noting` makes calls :func:`contactfpga_hdl.note`. A board that
comes compiled from the cache counts for the tests that use it as well as for the one that had it built.
"""

import json
import os
from pathlib import Path

import pytest

import contactfpga_hdl
from contactfpga_sim.model.board import native

_FOLDER = Path(os.environ["CONTACTFPGA_TOUCHED"])
_build = native.load
_built: dict[str, set[str]] = {}


def _load(model):
    """As ``native.load``, and what elaborates the model is noted each time."""
    key = f"{model.key} {model.driver} {sorted(model.defines.items())} {model.passes}"
    noted, outside = contactfpga_hdl.noted, set(contactfpga_hdl.noted)
    noted.clear()
    library = _build(model)
    if key not in _built and not noted and not isinstance(design := model.elaborate(), native.Netlist):
        native.rtlil(design)
    _built[key] = _built.get(key, set()) | noted
    noted.update(outside, _built[key])
    return library


native.load = _load


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_protocol(item):
    contactfpga_hdl.noted.clear()
    started = sum(os.times()[:4])  # of this process and those that it started
    yield
    line = {
        "test": item.nodeid,
        "seconds": sum(os.times()[:4]) - started,
        "touched": sorted(contactfpga_hdl.noted),
    }
    with (_FOLDER / f"{os.getpid()}.jsonl").open("a") as file:
        file.write(json.dumps(line) + "\n")
