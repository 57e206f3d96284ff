"""What can go wrong with a command: it says so in a sentence."""

import importlib.metadata
import os
import sys

import pytest
from sample import sample

from contactfpga import errors

# ---- what can go wrong


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["zones", "/dev/no_such_port"], "/dev/no_such_port cannot be opened: No such file or directory"),
        (["zones", "sim://?scene=elbow"], "scene 'elbow' is not known"),
        (["zones", "sim://", "--skin", "/no/skin.toml"], "contactfpga: /no/skin.toml: No such file or directory"),
        (["zones", "replay:///no/such.bin"], "replay:///no/such.bin cannot be opened"),
        (["replay", "/no/such.npy"], "/no/such.npy"),
        (["board", "--skin", "/no/skin.toml"], "/no/skin.toml"),
        (["board", "--scene", "elbow"], "scene 'elbow' is not known"),
    ],
)
def test_errors_are_one_line_without_a_traceback(arguments, message, run):
    status, out, errors = run(*arguments)
    assert (status, out) == (1, "")
    assert errors.startswith("contactfpga: ")
    assert errors.count("\n") == 1
    assert message in errors


def test_bad_skin_file_is_named(tmp_path, run):
    file = tmp_path / "skin.toml"
    file.write_text("rows = 65\n")
    status, _, errors = run("zones", f"sim://?skin={file}")
    assert status == 1
    assert errors == f"contactfpga: {file}: rows is 65; it must lie between 1 and 64\n"


EXTRAS = [
    (["record", "x.mcap", "sim://"], "contactfpga_sim.model.board.virtual", "record,sim"),
    (["zones", "--once", "sim://"], "rich.console", "cli"),
    (["board"], "contactfpga_sim.model.board.virtual", "sim"),
    (["build", "icestick"], "amaranth.build", "boards"),
    (["study", "chart"], "scipy.optimize", "chart"),
    (["study", "chart", "--dask", "tcp://127.0.0.1:1"], "distributed", "cluster"),
    (["wire", "sim://"], "rich.console", "cli"),
    (["replay", "x.npy"], "contactfpga_sim.model.board.replay", "sim"),
    (["zones", "--json", "sim://"], "contactfpga_sim.model.board.virtual", "sim"),
    (["build", "icestick"], "amaranth_boards.icestick", "boards"),
    (["fit", "bumper"], "rich.console", "chart"),
    (["fit", "bumper"], "scipy.optimize", "chart"),
    (["board"], "contactfpga_sim.model.board.pty_board", "sim"),
    (["publish", "sim://"], "contactfpga_sim.model.board.virtual", "net,sim"),
    (["study", "arm"], "matplotlib.figure", "sim"),
    (["study", "arm", "--charts", "--dask", "tcp://127.0.0.1:1"], "distributed", "cluster"),
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
