"""The README's headline figures are those of the pages whose commands measure them."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
MOST = 6


def headlines() -> list[list[str]]:
    """The fields of each row of the README's table of figures."""
    (section,) = re.findall(
        r"^## Simulated\n(.*?)^## ", (ROOT / "README.md").read_text(), flags=re.DOTALL | re.MULTILINE
    )
    lines = [line for line in section.splitlines() if line.startswith("|")]
    return [[field.strip() for field in line.strip("|").split("|")] for line in lines[2:]]


def line(page: str, start: str) -> list[str]:
    """The fields of the one table row of a page that begins like this."""
    (found,) = [line for line in (ROOT / "docs" / page).read_text().splitlines() if line.startswith(start)]
    return [field.strip(" *") for field in found.strip("|").split("|")]


def reference() -> list[str]:
    return line("performance.md", "| reference | 96 us |")


def fast() -> list[str]:
    return line("performance.md", "| 16x16 | 3x3 |")


def contacts_on_32x32() -> list[str]:
    return line("chart.md", "| 32x32 | 5 |")


def eight_touches() -> list[str]:
    return line("arm.md", "| UART | 8 |")


def anywhere_by_uart(geometry: str) -> str:
    return line("arm.md", geometry)[5]


def worst_clocks(labeller: str) -> str:
    return line("performance.md", f"| 16x16 | {labeller} |")[2]


HEADLINES = (
    ("to the last byte", lambda: reference()[3], lambda: f"{eight_touches()[2]} ms"),
    ("by line reversal", lambda: fast()[3], lambda: "the row above"),
    ("`contact` pin", lambda: reference()[2], lambda: "1 ms"),
    (
        "Five contacts on 32x32",
        lambda: contacts_on_32x32()[2].split(",")[0],
        lambda: contacts_on_32x32()[3].split(",")[0],
    ),
    ("Labeller", lambda: worst_clocks("`run`"), lambda: f"{worst_clocks('LinkRunCCA')} for LinkRunCCA"),
    (
        "Peak force",
        lambda: f"{anywhere_by_uart('| tiles | 6.4 | 0.4 | 5 |')} N",
        lambda: f"{anywhere_by_uart('| flush, point force | 10 | 1 | 5 |')} N",
    ),
)


def test_there_is_one_table_of_a_few_figures():
    assert len(headlines()) == len(HEADLINES) <= MOST
    assert (ROOT / "README.md").read_text().count("\n|---") == 2  # this one and that of the folders


@pytest.mark.parametrize(("index", "headline"), list(enumerate(HEADLINES)), ids=[name for name, *_ in HEADLINES])
def test_a_headline_says_what_its_page_says(index, headline):
    name, ours, other = headline
    what, here, against = headlines()[index]
    assert name in what
    assert here == f"**{ours()}**"
    assert other() in against


def test_the_time_on_the_host_is_that_of_the_page():
    assert f"and {contacts_on_32x32()[4]} to label them on the host" in " ".join(headlines()[3])


@pytest.mark.parametrize("index", range(len(HEADLINES)))
def test_each_headline_links_to_the_page_that_measures_it(index):
    (link,) = re.findall(r"\]\((docs/[^)]*)\)", headlines()[index][0])
    page, _, anchor = link.partition("#")
    titles = re.findall(r"^## (.*)$", (ROOT / page).read_text(), flags=re.MULTILINE)
    assert anchor in {title.lower().replace("'", "").replace(" ", "-") for title in titles}
