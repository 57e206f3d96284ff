"""The README's headline figures are those of the pages whose commands measure them."""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
MOST = 7


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


def peaks(face: str, pitch_mm: float, threshold_n: float, foam_mm: float) -> list[str]:
    """Worst / mean in N by UART, 6 ms late and without a stop, from the file of all rows of the arm's page."""
    sheet = f"{face},{pitch_mm:g},{threshold_n:g},{foam_mm:g},"
    text = (ROOT / "docs/tables/arm-places.csv").read_text()
    (row,) = [line.removeprefix(sheet).split(",") for line in text.splitlines() if line.startswith(sheet)]
    return [" / ".join(reversed(row[column].split(" / "))) for column in (1, 0, 3)]


KITS = [tomllib.loads((ROOT / f"examples/kits/{kit}/skin.toml").read_text()) for kit in ("starter", "fast")]


def peaks_of(skin: dict) -> list[str]:
    cover = skin["cover"]
    return peaks("tiles", skin["pitch_x_mm"], cover["switch"]["force_n"], 1e3 * cover["thickness_m"])


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


def test_counts_are_those_of_their_page():
    fingers, page = headlines()[3], (ROOT / "docs" / "kits.md").read_text()
    (row,) = re.findall(r"^\| two to five fingers of 2 to 20 N \| (.*) \|$", page, re.MULTILINE)
    assert "two to five fingers of 2 to 20 N" in fingers[0]
    assert fingers[1:3] == [f"**{share}**" for share in row.split(" | ")]
    low, high = map(float, re.search(r"\((.*) to (.*)\)", fingers[1]).groups())
    assert high - low < 1.5, "4,000 scenes"


def test_forces_are_those_of_each_kits_own_foam():
    rows = headlines()[4:]
    assert [("6 ms late" in what, "no stop" in what) for what, *_ in rows] == [(0, 0), (1, 0), (0, 1)]
    for column, skin in enumerate(KITS, 1):
        foam_mm = 1e3 * skin["cover"]["thickness_m"]
        assert [row[column] for row in rows] == [f"**{each} N**, {foam_mm:g} mm of foam" for each in peaks_of(skin)]
    paper = peaks('"flush, point force"', 10, 1, 5)
    assert [row[3] for row in rows] == [f"{each} N with the paper's sheet, 5 mm of foam" for each in paper]


@pytest.mark.parametrize("page", ["kits.md", "safety.md", "arm.md"])
def test_pages_say_what_a_late_stop_costs_over_the_kits_foam(page):
    text = " ".join((ROOT / "docs" / page).read_text().split())
    late, never = (each.split(" / ")[0] for each in peaks_of(KITS[0])[1:])
    (said,) = re.findall(r"2 mm of foam.{0,60}?6 ms late.{0,120}?([\d.]+) N.{0,40}?no stop.{0,40}?([\d.]+) N", text)
    assert said == (late, never)
