"""The examples in the pages run and print what they say."""

import doctest
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted(
    str(page.relative_to(ROOT))
    for page in (ROOT / "README.md", *(ROOT / "docs").glob("*.md"))
    if ">>>" in page.read_text()
)


def test_the_pages_have_examples():
    assert {"README.md", "docs/use.md", "docs/skin.md"} <= set(PAGES)


@pytest.mark.parametrize("page", PAGES)
def test_examples_print_what_they_say(page):
    results = doctest.testfile(str(ROOT / page), module_relative=False)
    assert results.attempted > 0
    assert results.failed == 0
