"""The studies: each section of a page has one owner and shows what its study makes; a toy study is made, listed and
found out of date."""

import csv
import dataclasses
import functools
import inspect
import re
import sys
from collections import Counter
from pathlib import Path

import pytest
from study_pages import DOCS, section

from contactfpga.errors import ContactFPGAError, MissingExtra
from contactfpga_sim.lab import __main__ as runner
from contactfpga_sim.lab import fingerprints, reach, studies, writer
from contactfpga_sim.lab.registry import Section, Study, StudyRun
from contactfpga_sim.lab.studies import STUDIES

ROOT = DOCS.parent
LAB = ROOT / "sim/contactfpga_sim/lab"
DECLARED = list(STUDIES.values())
PLACES = [
    (study, place)
    for study in DECLARED
    for place in (
        *(one for section in study.sections.values() for one in (section.makes, section.sample)),
        *(study.compute, study.pictures),
    )
    if place
]
SECTIONS = [(study.name, name, section) for study in DECLARED for name, section in study.sections.items()]
QUICK = {"cover", "failures", "haptics", "kits", "maker", "safety", "settle", "skin", "units"}
"""Studies whose samples `make test` makes; the other samples are for `make test-all`."""
WHOLE = {"arm", "closed", "fit", "maker pulls", "maker series", "performance",
         "safety", "tracking scores"}  # fmt: skip
"""Studies, and sections, that `make campaign` makes whole; of a section that is named no sample is made."""
SHOWN = [
    *(
        pytest.param(study, name, "sampled", marks=() if study in QUICK else pytest.mark.slow)
        for study, name, section in SECTIONS
        if section.sample and f"{study} {name}" not in WHOLE
    ),
    *(
        pytest.param(study, name, "text", marks=(pytest.mark.campaign, pytest.mark.timeout(7200)))
        for study, name, section in SECTIONS
        if {study, f"{study} {name}"} & WHOLE
    ),
]
DRAWN = [
    *("scenes", "settle", "sheet", "tracking", "wave"),
    pytest.param("arm", marks=(pytest.mark.campaign, pytest.mark.timeout(7200))),
]


def test_each_section_of_a_page_has_one_owner():
    """Also those of which the study has a section that no page shows."""
    shown = Counter(
        (page.name, name)
        for page in (*DOCS.glob("*.md"), ROOT / "README.md")
        for name in re.findall(r"^<!-- figures: (\w+)[^\n]*-->$", page.read_text(encoding="utf-8"), re.MULTILINE)
    )
    owned = Counter((Path(study.page_of(name)).name, name) for study in DECLARED for name in study.sections)
    assert owned == shown
    assert set(owned.values()) == {1}


def test_each_folder_with_tables_or_pictures_is_a_study():
    made = {path.parent.name for name in ("tables", "pictures") for path in LAB.glob(f"*/{name}.py")}
    assert made <= set(STUDIES)
    assert list(STUDIES) == sorted(STUDIES)
    for study in DECLARED:
        assert (DOCS / study.page).is_file()
        assert study.title
        assert study.minutes > 0
        assert study.sections or study.pictures


@pytest.mark.parametrize(("study", "place"), PLACES, ids=lambda value: value if isinstance(value, str) else value.name)
def test_each_function_that_is_declared_exists(study, place):
    try:
        parameters = inspect.signature(study.function(place)).parameters.values()
    except ImportError as error:
        pytest.skip(str(error))
    wanted = sum(one.default is one.empty for one in parameters)
    drawn = place == study.pictures
    assert wanted in ((drawn, drawn + 1) if study.compute else (drawn,))


@functools.cache
def run_of(study):
    return StudyRun(STUDIES[study])


@pytest.mark.parametrize(("study", "name", "how"), SHOWN)
def test_a_page_shows_what_its_study_makes(study, name, how):
    """A sample of the section, or all of it."""
    declared = STUDIES[study]
    absent = runner.lacking((*declared.needs, *declared.sections[name].needs))
    if absent:
        pytest.skip(f"needs {', '.join(absent)}")
    made = getattr(run_of(study), how)(name)
    assert f"\n{made}\n" in f"\n{section(declared.page_of(name), name)}\n"


@pytest.mark.parametrize("study", DRAWN)
def test_a_page_shows_the_pictures_that_its_study_draws(study, tmp_path):
    drawn = run_of(study).call(STUDIES[study].pictures, tmp_path)
    for picture in drawn if isinstance(drawn, list) else [drawn]:
        assert picture.read_bytes() == (DOCS / "images" / picture.name).read_bytes(), picture.name


MOST_ROWS = 8
READ_WHOLE = {"fields", "wiring"}
"""A reader looks up any row of these."""


def shown(study, name):
    """The section's text as the page has it."""
    return writer.sections((DOCS / study.page_of(name)).read_text(encoding="utf-8"))[name].text


def longest(text):
    """Rows of the longest table."""
    return max((table.count("\n") - 2 for table in re.findall(r"(?:^\|.*\|\n)+", f"{text}\n", re.MULTILINE)), default=0)


def file_of(study, name):
    return f"{Path(study.page_of(name)).stem}-{name}.csv"


@pytest.mark.parametrize(
    ("study", "name"),
    [(study, name) for study in DECLARED for name in study.sections],
    ids=lambda value: value if isinstance(value, str) else value.name,
)
def test_a_section_shows_a_picture_or_at_most_eight_rows(study, name):
    """Of a table in a file at least three rows, which are there, too."""
    text = shown(study, name)
    assert longest(text) <= MOST_ROWS or name in READ_WHOLE
    if f"({writer.FOLDER}/{file_of(study, name)})" in text:
        with open(DOCS / writer.FOLDER / file_of(study, name), newline="", encoding="utf-8") as file:
            head, *rows = list(csv.reader(file))
        lines = text.partition("\n\nAll [")[0].splitlines()
        cells, *page = [line[2:-2].split(" | ") for line in lines if line.startswith("| ")]
        columns = [at for at, title in enumerate(head) if title in cells]
        assert len(columns) == len(cells)
        assert len(page) >= 3
        assert (len(page), len(cells)) != (len(rows), len(head))
        picked = iter([[row[at] for at in columns] for row in rows])
        assert all(row in picked for row in page)


MEASURED_ONCE = {"rivals-rivals.csv", "rivals-rivals_exact.csv", "rivals-rivals_made_of.csv", "net-links.csv"}
WRITTEN_ELSEWHERE = MEASURED_ONCE | {"formal-claims.csv", "mutants-alive.csv", "verification.csv"}
"""By hand, or by `make verification`."""


def test_each_file_beside_the_pages_belongs_to_a_section():
    linked = {
        file_of(study, name)
        for study in DECLARED
        for name in study.sections
        if f"({writer.FOLDER}/{file_of(study, name)})" in shown(study, name)
    }
    assert {path.name for path in (DOCS / writer.FOLDER).iterdir()} == linked | WRITTEN_ELSEWHERE


# ---- a toy study: its declaration and its function


MAKES = """
from pathlib import Path

def compute():
    return [1, 2]

def table(found):
    return "| sum |\\n|---|\\n| " + str(sum(found)) + " |"

def fixed():
    return "always"

def draw(folder, found):
    (folder / "toy.svg").write_text(str(found))
    return folder / "toy.svg"
"""


TOYS = {"toy": Section("tables:table"), "fixed": Section("tables:fixed")}


@pytest.fixture
def toy(tmp_path, monkeypatch):
    """A project of one page and one study."""
    (tmp_path / "docs").mkdir()
    page = tmp_path / "docs" / "toy.md"
    page.write_text("a\n<!-- figures: toy -->\nold\n<!-- end -->\n<!-- figures: fixed of 1234 -->\nb\n<!-- end -->\n")
    (tmp_path / "toys" / "toy").mkdir(parents=True)
    for file, text in (("__init__", ""), ("toy/__init__", ""), ("toy/tables", MAKES)):
        (tmp_path / "toys" / f"{file}.py").write_text(text)
    places = {"compute": "tables:compute", "pictures": "tables:draw", "package": "toys"}
    declared = Study("toy", title="Toys", page="toy.md", minutes=1, sections=TOYS, **places)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(studies, "STUDIES", {"toy": declared})
    monkeypatch.syspath_prepend(tmp_path)
    forget()
    yield page
    for name in [name for name in sys.modules if name.partition(".")[0] == "toys"]:
        del sys.modules[name]


def forget():
    """What fingerprints know of files, which a running program does not change."""
    fingerprints._of.cache_clear()
    reach._parsed.cache_clear()
    reach._datum.cache_clear()


def run(monkeypatch, *arguments):
    monkeypatch.setattr(sys, "argv", ["lab", *arguments])
    return runner.main()


def test_a_study_writes_its_sections_and_draws(toy, monkeypatch, capsys):
    assert run(monkeypatch, "toy") == 0
    written = writer.sections(toy.read_text())
    assert written["toy"].text == "| sum |\n|---|\n| 3 |"
    assert written["fixed"].text == "always"
    assert all(re.fullmatch(r"[0-9a-f]{8}", one.fingerprint) for one in written.values())
    assert toy.read_text().startswith("a\n")
    assert Path("docs/images/toy.svg").read_text() == "[1, 2]"
    assert capsys.readouterr().out.splitlines() == ["toy.md: toy", "toy.md: fixed", "drew docs/images/toy.svg"]


def test_sections_are_out_of_date_once_what_they_are_made_by_means_something_else(toy, monkeypatch, capsys):
    def stale():
        forget()
        assert run(monkeypatch, "--stale") == 0
        return [line for line in capsys.readouterr().out.splitlines() if line]

    assert stale() == ["toy.md: toy: make pages NAME=toy", "toy.md: fixed: make pages NAME=toy"]
    run(monkeypatch, "--all")
    capsys.readouterr()
    assert stale() == []
    code = Path("toys/toy/tables.py")
    code.write_text(
        '"""Explained."""\nimport os\n# and more\n' + MAKES.replace("    return [1", '    "It."\n    return  [1')
    )
    assert stale() == []
    moved = MAKES.partition("def fixed")
    code.write_text("from toys.toy.beside import fixed, draw\n" + moved[0])
    Path("toys/toy/beside.py").write_text("".join(moved[1:]))
    assert stale() == []
    code.write_text(code.read_text() + "def drawn_by_nobody():\n    return 5\n")
    assert stale() == []
    code.write_text(code.read_text().replace("[1, 2]", "[1, 3]"))
    assert len(stale()) == 2


def test_what_the_machine_lacks_is_told_and_left_out_of_all(toy, monkeypatch, capsys):
    whole = studies.STUDIES["toy"]
    lacking = Study("toy", title="Toys", page="toy.md", minutes=1, needs=("no-such-program", "no/such/folder"))
    monkeypatch.setattr(studies, "STUDIES", {"toy": lacking})
    with pytest.raises(ContactFPGAError, match=r"^toy needs no-such-program, no/such/folder$"):
        run(monkeypatch, "toy")
    assert run(monkeypatch, "--all") == 0
    assert capsys.readouterr().err == "left out: toy needs no-such-program, no/such/folder\n"
    without = {"toy": dataclasses.replace(TOYS["toy"], needs=("no/such/folder",))}
    part = dataclasses.replace(whole, sections=without, pictures="")
    monkeypatch.setattr(studies, "STUDIES", {"toy": part})
    assert run(monkeypatch, "toy") == 0
    assert capsys.readouterr().out == "toy.md: toy stays as it is without no/such/folder\n"
    assert "old" in toy.read_text()


def test_a_package_that_is_not_installed_is_told_with_its_extra(toy, monkeypatch):
    Path("toys/toy/tables.py").write_text("import no_such_package_of_anybody")
    with pytest.raises(MissingExtra, match=r"^toy needs more than is installed; .*\[sim\]'"):
        run(monkeypatch, "toy")


def test_studies_together_take_an_hour_but_those_made_apart():
    assert sum(study.minutes for study in DECLARED if not study.apart) <= 70
    assert {study.name for study in DECLARED if study.apart} == {"mutants", "sizes"}


def test_a_study_that_is_made_apart_may_be_out_of_date_and_is_made_by_its_name(toy, monkeypatch, capsys):
    with pytest.raises(ContactFPGAError, match=r"^pages are out of date; toy\.md: toy: make pages NAME=toy; toy\.md: "):
        run(monkeypatch, "--check")
    apart = dataclasses.replace(studies.STUDIES["toy"], apart=True, minutes=1e-9)
    monkeypatch.setattr(studies, "STUDIES", {"toy": apart})
    assert run(monkeypatch, "--check") == 0
    assert run(monkeypatch, "--all") == 0
    assert "old" in toy.read_text()
    assert run(monkeypatch, "toy") == 0
    assert "old" not in toy.read_text()
    assert "; its limit on two cores is 1e-09" in capsys.readouterr().err


def test_all_studies_are_listed_without_what_they_need(monkeypatch, capsys):
    assert run(monkeypatch, "--list") == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(STUDIES)
    assert run(monkeypatch, "--list", "--quick") == 0
    assert 0 < len(capsys.readouterr().out.splitlines()) < len(lines)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nobody"], r"study 'nobody' is not known; take one of: toy"),
        ([], "name a study, or give --all or --list"),
    ],
)
def test_what_cannot_be_made_is_refused(toy, monkeypatch, arguments, message):
    with pytest.raises((ContactFPGAError, ValueError), match=message):
        run(monkeypatch, *arguments)


def test_a_study_is_refused_where_there_are_no_pages(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ContactFPGAError, match="there is no folder 'docs' here"):
        run(monkeypatch, "--all")
