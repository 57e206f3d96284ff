"""The README's headline figures are those of the pages whose commands measure them."""

import csv
import itertools
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
MOST = 7
BODIES = ("forearm", "rigid")


def headlines() -> list[list[str]]:
    """What, starter kit, fast kit and compared with what, of each row of the README's table of figures."""
    (section,) = re.findall(
        r"^## Simulated\n(.*?)^## ", (ROOT / "README.md").read_text(), flags=re.DOTALL | re.MULTILINE
    )
    rows = re.findall(r"^\| (.*) \| (.*) \| (.*) \|$", section, re.MULTILINE)[1:]  # below the heading
    return [[what, *of_kits(kits), against] for what, kits, against in rows]


def of_kits(cell: str) -> list[str]:
    """[A, B] of "starter A; fast B", [A, A] of "both A"."""
    if cell.startswith("both "):
        return [cell.removeprefix("both ")] * 2
    (both,) = re.findall(r"^starter (.*); fast (.*)$", cell)
    return list(both)


def line(page: str, start: str) -> list[str]:
    """The fields of the first table row of a page that begins like this."""
    found = next(line for line in (ROOT / "docs" / page).read_text().splitlines() if line.startswith(start))
    return [field.strip(" *") for field in found.strip("|").split("|")]


def worst_and_median(kit: str, stage: str) -> tuple[float, float]:
    """In us."""
    fields = line("kits.md", f"| {kit} | {stage}")
    return float(fields[4].replace(",", "")), float(fields[2].replace(",", ""))


def peaks(sheet: str, body: str) -> dict[str, str]:
    """Worst / mean in N by the heading of a way, at the lower speed, from the file of all rows of the arm's page."""
    with open(ROOT / "docs/tables/arm-kits.csv", newline="") as file:
        row, *_ = [row for row in csv.DictReader(file) if (row["sheet"], row["body"]) == (sheet, body)]
    return {head.partition(":")[0]: value for head, value in row.items()}


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


def test_the_table_of_assumptions_starts_from_the_headlines():
    """Its mean peaks are of 16 touches, those of the README of many more: both are within 5 % of each other."""
    said = re.search(r"mean peak force, rigid (.*?) N; the same, forearm (.*?) N", (ROOT / "docs/kits.md").read_text())
    for body, value in zip(("rigid", "forearm"), said.groups(), strict=True):
        _, mean = peaks("starter", body)["UART"].split(" / ")
        assert float(value) == pytest.approx(float(mean), rel=0.05)


def test_counts_are_those_of_their_page():
    fingers, page = headlines()[3], (ROOT / "docs" / "kits.md").read_text()
    (row,) = re.findall(r"^\| two to five fingers of 2 to 20 N \| (.*) \|$", page, re.MULTILINE)
    assert "two to five fingers of 2 to 20 N" in fingers[0]
    assert fingers[1:3] == [f"**{share}**" for share in row.split(" | ")]
    low, high = map(float, re.search(r"\((.*) to (.*)\)", fingers[1]).groups())
    assert high - low < 1.5, "4,000 scenes"


def test_forces_are_those_of_each_kit_on_a_soft_and_a_rigid_body():
    rows = headlines()[4:]
    assert [("6 ms late" in what, "no stop" in what) for what, *_ in rows] == [(0, 0), (1, 0), (0, 1)]
    for way, (_, *cells) in zip(("UART", "6 ms", "limit alone"), rows, strict=True):
        starter, fast, paper = ([peaks(sheet, body)[way] for body in BODIES] for sheet in ("starter", "fast", "paper"))
        for cell, (soft, rigid) in zip(cells, (starter, fast), strict=False):
            assert cell == f"**{soft} N** forearm, **{rigid} N** rigid"
        assert cells[2] == f"{paper[0]} N forearm, {paper[1]} N rigid with the paper's sheet"


def test_a_late_stop_or_none_costs_no_more_than_under_the_papers_sheet():
    """Worst and mean, on each body at both speeds."""
    with open(ROOT / "docs/tables/arm-kits.csv", newline="") as file:
        rows = {(row.pop("sheet"), row.pop("body"), row.pop("speed, m/s")): row for row in csv.DictReader(file)}
    kits = [key for key in rows if key[0] in ("starter", "fast")]
    assert len(kits) == 2 * 3 * 2
    for (kit, *where), way in itertools.product(kits, ("6 ms", "limit alone")):
        both = (rows[(sheet, *where)][f"{way}: worst / mean, N"] for sheet in (kit, "paper"))
        ours, theirs = (list(map(float, text.split(" / "))) for text in both)
        assert all(mine <= paper for mine, paper in zip(ours, theirs, strict=True)), (kit, *where, way)


@pytest.mark.parametrize("page", ["kits.md", "safety.md"])
def test_pages_say_what_a_late_stop_costs_with_the_starter_kit(page):
    text = " ".join((ROOT / "docs" / page).read_text().split())
    said = re.findall(r"from ([\d.]+)( N \(95 %\))? to ([\d.]+)( N \(95 %\))? N on a (forearm|rigid)", text)
    found = ((body, [peaks("starter", body)[way].split(" / ")[0] for way in ("UART", "6 ms")]) for body in BODIES)
    for (first, part, last, other, where), (body, (uart, late)) in zip(said, found, strict=True):
        assert where == body
        for number, quantile, worst in ((first, part, uart), (last, other, late)):
            assert worst.startswith(f"95 %: {number} ") if quantile else worst == number
