"""What the options of tests/conftest.py leave out of a run."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow  # it starts pytest six times

TESTS = """
import pytest

@pytest.mark.slow
@pytest.mark.parametrize("case", ["passes", "fails", "a.b::c/d", "\\u03a9", "[x]", "5", "6"])
def test_seven(case):
    assert case != "fails"

@pytest.mark.campaign
@pytest.mark.parametrize("case", [1, 2])
def test_two(case):
    if case == 2:
        pytest.skip("not here")

@pytest.mark.slow
def test_one():
    pass

@pytest.mark.parametrize("case", [1, 2, 3, 4])
def test_quick(case):
    pass
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Runs pytest with these words where the tests above are; returns what it had, in order."""
    folder = tmp_path_factory.mktemp("left out")
    (folder / "tests").mkdir()
    shutil.copy(Path(__file__).parents[1] / "conftest.py", folder / "tests")
    (folder / "tests" / "test_it.py").write_text(TESTS, encoding="utf-8")
    (folder / "pytest.ini").write_text("[pytest]\njunit_family = xunit1\n")

    def run(*words):
        command = [sys.executable, "-m", "pytest", "-v", "-p", "no:cacheprovider", *words]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, encoding="utf-8", timeout=250)
        return re.findall(r"^tests/test_it.py::(.*) (?:PASSED|FAILED|SKIPPED)", done.stdout, re.MULTILINE)

    return run


def test_three_numbers_draw_every_case_and_each_a_third_of_a_test_and_of_a_files_slow_ones(run):
    every, thirds = run(), [run(f"--third={number}") for number in (4, 5, 6)]
    assert len(every) == 14
    assert {name for third in thirds for name in third} == {*every}
    for name, most in (("test_quick", [1, 1, 2]), ("test_", [4, 4, 6])):
        assert sorted(sum(one.startswith(name) for one in third) for third in thirds) == most


def test_what_passed_in_a_run_is_left_out_of_the_next_one(run):
    run("--junitxml", "build/tests.xml", "--third=1")
    again = run("--passed=build/tests.xml")
    assert "test_seven[fails]" in again
    assert "test_two[2]" in again, "it was skipped"
    assert len(again) == 14 - 3
