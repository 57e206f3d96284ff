"""The built pages in a real browser: none is wider than its window, and those for users are not too long."""

import re
from pathlib import Path

import pytest

pytest.importorskip("viser")
pytest.importorskip("playwright")

from contactfpga_sim.lab.view import browser

pytestmark = [
    pytest.mark.slow,  # a minute
    pytest.mark.timeout(1200),  # the first one builds all pages, also on a busy machine
    pytest.mark.skipif(browser.program() is None, reason="no Chromium is installed"),
]

DOCS = Path(__file__).resolve().parents[2] / "docs"
WIDTHS = 1400, 390
MOST_PX = 12_000
"""In height, at the greater width."""
FOR_USERS = "Start", "Guide", "Hardware"
MEASURED = "[document.documentElement.scrollWidth, document.documentElement.scrollHeight]"


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    pytest.importorskip("furo")
    from sphinx.application import Sphinx

    built = tmp_path_factory.mktemp("site")
    application = Sphinx(DOCS, DOCS, built / "html", built / "doctrees", "html", status=None, warningiserror=True)
    application.build()
    assert application.statuscode == 0
    return built / "html"


def measured(chromium, path, width):
    """Width and height of a page."""
    page = chromium.new_page(viewport={"width": width, "height": 900})
    page.goto(path.as_uri())
    found = page.evaluate(MEASURED)
    page.close()
    return found


def for_users():
    """Names of the pages in these groups of the index."""
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    groups = dict(section.split("\n", 1) for section in re.split(r"^## ", index, flags=re.MULTILINE)[1:])
    return {name for group in FOR_USERS for name in re.findall(r"^\| \[.+\]\((\w+)\.md\)", groups[group], re.MULTILINE)}


def test_no_page_is_wider_than_its_window(site, chromium):
    pages = [path for path in site.glob("*.html") if path.stem != "try"]
    assert len(pages) > len(list(DOCS.glob("*.md")))
    sizes = {(path.stem, width): measured(chromium, path, width)[0] for path in pages for width in WIDTHS}
    assert {page: size for page, size in sizes.items() if size > page[1]} == {}


def test_pages_for_users_are_not_too_long(site, chromium):
    heights = {name: measured(chromium, site / f"{name}.html", WIDTHS[0])[1] for name in for_users()}
    assert len(heights) > 20
    assert {name: height for name, height in heights.items() if height > MOST_PX} == {}


def test_the_sidebar_has_the_groups_of_the_index(site):
    text = (site / "index.html").read_text(encoding="utf-8")
    captions = re.findall(r'<p class="caption"[^>]*><span class="caption-text">([^<]*)', text)
    assert captions == ["Start", "Guide", "Hardware", "Reference", "Internals", "Evidence"]


def test_a_page_that_is_too_wide_or_too_long_is_seen(tmp_path, chromium):
    page = tmp_path / "page.html"
    page.write_text('<div style="width: 1401px; height: 12001px">')
    width, height = measured(chromium, page, WIDTHS[0])
    assert width > WIDTHS[0]
    assert height > MOST_PX
