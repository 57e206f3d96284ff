"""What can go wrong with a command: it says so in a sentence."""

import importlib.metadata
import os
import sys

import pytest
from sample import sample

from contactfpga import errors

EXTRAS = [
    (["record", "x.mcap", "sim://"], "contactfpga_sim.model.board.virtual", "record,sim"),
    (["zones", "--once", "sim://"], "rich.console", "cli"),
    (["board"], "contactfpga_sim.model.board.virtual", "sim"),
    (["build", "icestick"], "amaranth.build", "boards"),
    (["study", "chart"], "scipy.optimize", "chart"),
    (["study", "chart", "--dask", "tcp://127.0.0.1:1"], "distributed", "cluster"),
    (["publish", "sim://"], "contactfpga_sim.model.board.virtual", "net,sim"),
    (["study", "arm"], "matplotlib.figure", "sim"),
]


@pytest.mark.parametrize(("arguments", "module", "extra"), sample(EXTRAS, quick=EXTRAS[:4]))
def test_a_missing_extra_is_named_with_its_command(python, arguments, module, extra):
    code = f"""
import sys
sys.modules[{module!r}] = None  # as if it were not installed
from contactfpga.tools import cli
sys.exit(cli.main(sys.argv[1:]))
"""
    result = python(code, *arguments)
    assert result.returncode == 1
    assert result.stdout == ""
    assert result.stderr.count("\n") == 1
    if "rich" in module:
        assert "rich" in result.stderr
    assert f" -m pip install 'contactfpga[{extra}]'\n" in result.stderr


@pytest.mark.parametrize(
    ("folder", "python", "shown"),
    [
        ("/home/me/clone", "/home/me/clone/.venv/bin/python", ".venv/bin/python"),
        ("/home/me", "/usr/bin/python3", "/usr/bin/python3"),
        ("/home/me/bin", "/home/me/bin/python", "/home/me/bin/python"),
        ("/home/me", "/opt/my tools/python", "'/opt/my tools/python'"),
    ],
)
def test_an_extra_goes_to_the_python_that_lacks_it(monkeypatch, folder, python, shown):
    monkeypatch.setattr(os, "getcwd", lambda: folder)
    monkeypatch.setattr(sys, "executable", python)
    assert errors.pip_install("net") == f"{shown} -m pip install 'contactfpga[net]'"


def test_an_extra_of_sources_that_nobody_installed(monkeypatch):
    def absent(name):
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "version", absent)
    assert errors.pip_install("net").endswith(" -m pip install '.[net]', in the folder of contactfpga's sources")
