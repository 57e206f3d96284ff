"""The README's headline figures are those of the pages whose commands measure them."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
MOST = 5


def headlines() -> list[list[str]]:
    """The fields of each row of the README's table of figures: what, starter kit, fast kit, compared with what."""
    (section,) = re.findall(
        r"^## Simulated\n(.*?)^## ", (ROOT / "README.md").read_text(), flags=re.DOTALL | re.MULTILINE
    )
    lines = [line for line in section.splitlines() if line.startswith("|")]
    return [[field.strip() for field in line.strip("|").split("|")] for line in lines[2:]]


def line(page: str, start: str) -> list[str]:
    """The fields of the first table row of a page that begins like this."""
    found = next(line for line in (ROOT / "docs" / page).read_text().splitlines() if line.startswith(start))
    return [field.strip(" *") for field in found.strip("|").split("|")]


def worst_and_median(kit: str, stage: str) -> tuple[float, float]:
    """In us."""
    fields = line("kits.md", f"| {kit} | {stage}")
    return float(fields[4].replace(",", "")), float(fields[2].replace(",", ""))


def worst_and_mean(geometry: str) -> str:
    mean, worst = line("arm.md", geometry)[5].split(" / ")
    return f"{worst} / {mean}"


def miscounted(method: str) -> str:
    """Of two to five fingers, with its interval: from the table of all families."""
    text = (ROOT / "docs/chart.md").read_text()
    (row,) = [line for line in text.splitlines() if line.startswith(method) and line.count(";") > 3]
    return row.strip("|").split("|")[2].split(";")[0].strip()


STAGES = {
    "decision": "closed switch to the decision",
    "last byte": "closed switch to the last byte",
    "pin `contact`": "closed switch to the pin",
}


def test_there_is_one_table_of_a_few_figures():
    assert len(headlines()) == MOST
    assert (ROOT / "README.md").read_text().count("\n|---") == 1  # this one


@pytest.mark.parametrize(("index", "name"), list(enumerate(STAGES)), ids=list(STAGES))
def test_times_are_those_of_the_kits_page_worst_first(index, name):
    what, *kits, against = headlines()[index]
    assert name in what
    assert what.endswith("worst / median")
    for kit, said in zip(("starter", "fast"), kits, strict=True):
        parts = said.strip("*").removesuffix(" µs").split(" / ")
        worst, median = (float(part.replace(",", "")) for part in parts)
        digits = len(parts[0].partition(".")[2])
        assert (worst, median) == pytest.approx(worst_and_median(kit, STAGES[name]), abs=0.5001 * 10**-digits)
        assert worst >= median
    assert against.startswith(("6,000 µs for the paper's", "up to 1,000 µs", "the same"))


def test_counts_and_forces_are_those_of_their_pages():
    fingers, force = headlines()[3:]
    assert fingers[1] == fingers[2] == f"**{miscounted('| run, 6.4 mm, tiles |')}**"
    assert fingers[3].startswith(miscounted("| run, 6.4 mm, paper |"))
    assert force[1] == force[2] == f"**{worst_and_mean('| tiles | 6.4 | 0.4 | 5 |')} N**"
    assert force[3].startswith(f"{worst_and_mean('| flush, point force | 10 | 1 | 5 |')} N")


@pytest.mark.parametrize("index", range(MOST))
def test_each_headline_links_to_the_page_that_measures_it(index):
    (link,) = re.findall(r"\]\((docs/[^)]*)\)", headlines()[index][0])
    page, _, anchor = link.partition("#")
    titles = re.findall(r"^## (.*)$", (ROOT / page).read_text(), flags=re.MULTILINE)
    assert anchor in {title.lower().replace("'", "").replace(" ", "-") for title in titles}
