"""A pytest plugin: the modules that Windows or a host alone does not have cannot be imported (``-p host_only``)."""

import sys

import pytest

ABSENT = {"fcntl", "grp", "pty", "pwd", "resource", "termios", "tty", "amaranth", "contactfpga_hdl"}
SIMULATION, PRESENT = "contactfpga_sim", "contactfpga_sim.model.golden"  # the golden model needs numpy alone
FIXTURES = {"bench", "board"}  # of conftest.py, which import some of them


class _Absent:
    @staticmethod
    def find_spec(name, path=None, target=None):
        present = f"{name}.".startswith(f"{PRESENT}.") or PRESENT.startswith(f"{name}.")
        simulation = name.startswith(f"{SIMULATION}.") and not present
        if simulation or name.partition(".")[0] in ABSENT:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


sys.meta_path.insert(0, _Absent)
for module in ABSENT & set(sys.modules):
    del sys.modules[module]


def pytest_collection_modifyitems(items):
    for item in items:
        if used := FIXTURES & set(item.fixturenames):
            raise pytest.UsageError(f"{item.nodeid} uses {', '.join(sorted(used))}, which needs more than a host")
