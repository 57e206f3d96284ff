"""The built pages in a real browser: none is wider than its window, and those for users are not too long."""

import re
from pathlib import Path

import pytest

pytest.importorskip("viser")
pytest.importorskip("playwright")

from contactfpga_sim.lab import browser

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


@pytest.fixture(scope="module")
def sizes(site, chromium):
    """{(name, width of the window): (width, height)} of all pages."""
    found = {}
    for width in WIDTHS:
        page = chromium.new_page(viewport={"width": width, "height": 900})
        for path in site.glob("*.html"):
            page.goto(path.as_uri())
            found[path.stem, width] = page.evaluate(MEASURED)
        page.close()
    return found


def for_users():
    """Names of the pages in these groups of the index."""
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    groups = dict(section.split("\n", 1) for section in re.split(r"^## ", index, flags=re.MULTILINE)[1:])
    return {name for group in FOR_USERS for name in re.findall(r"^\| \[.+\]\((\w+)\.md\)", groups[group], re.MULTILINE)}


def test_no_page_is_wider_than_its_window(sizes):
    assert len(sizes) > len(WIDTHS) * len(list(DOCS.glob("*.md")))
    assert {page: size for page, size in sizes.items() if size[0] > page[1] and page[0] != "try"} == {}


def test_pages_for_users_are_not_too_long(sizes):
    heights = {name: sizes[name, WIDTHS[0]][1] for name in for_users()}
    assert len(heights) > 20
    assert {name: height for name, height in heights.items() if height > MOST_PX} == {}


def test_the_sidebar_has_the_groups_of_the_index(site):
    text = (site / "index.html").read_text(encoding="utf-8")
    captions = re.findall(r'<p class="caption"[^>]*><span class="caption-text">([^<]*)', text)
    assert captions == ["Start", "Guide", "Hardware", "Reference", "Internals", "Evidence"]
