"""The examples in the pages run and print what they say."""

import doctest
import importlib
import re
from pathlib import Path

import pytest

import contactfpga

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


def documented(page: str) -> set[str]:
    """Names that the directives of the interface's page take: one by one, or all of a module that are its own."""
    found = set(re.findall(r"^\.\. auto(?:class|function):: (\S+)$", page, re.MULTILINE))
    for module in re.findall(r"^\.\. automodule:: (\S+)\n   :members:$", page, re.MULTILINE):
        values = vars(importlib.import_module(module)).items()
        found |= {f"contactfpga.{name}" for name, value in values if getattr(value, "__module__", None) == module}
    return found


def test_the_interface_page_has_every_public_name():
    page = (ROOT / "docs/api.md").read_text(encoding="utf-8")
    names = {f"contactfpga.{name}" for name in contactfpga.__all__}
    assert names - documented(page) == {"contactfpga.__version__"}
    assert "contactfpga.__version__" in page


def test_each_documented_module_has_its_heading():
    page = (ROOT / "docs/api.md").read_text(encoding="utf-8")
    for module in re.findall(r"^\.\. automodule:: (\S+)$", page, re.MULTILINE):
        assert re.search(rf"^#+ {re.escape(module)}$", page, re.MULTILINE), module


@pytest.mark.parametrize("page", sorted(path.name for path in (ROOT / "docs").glob("*.md") if path.name != "index.md"))
def test_each_page_is_in_a_group_of_the_index(page):
    assert f"\n{page.removesuffix('.md')}\n" in (ROOT / "docs/index.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    "page", [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))], ids=lambda path: path.name
)
def test_links_lead_to_files(page):
    links = re.findall(
        r"\]\(([^)#\s]+)[^)]*\)", re.sub(r"<!--.*?-->", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    )
    assert {link for link in links if "://" not in link and not (page.parent / link).exists()} == set()
