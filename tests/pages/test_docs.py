"""The examples in the pages run and print what they say."""

import contextlib
import doctest
import importlib.util
import io
import re
import runpy
import shlex
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from net_processes import PATIENCE, PUBLISHER
from sample import sample
from terminals import environment, listening

import contactfpga
from contactfpga.tools import cli

ROOT = Path(__file__).resolve().parents[2]
ALL_PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
GENERATED = {page.name for page in ALL_PAGES if page.name.startswith("api")}
"""Their text is that of the docstrings."""
EXAMPLE = re.compile(r"^ *(?:>>> |\$ (?:contactfpga|python) .*\n *\S)", re.MULTILINE)
PAGES = sorted(str(page.relative_to(ROOT)) for page in ALL_PAGES if EXAMPLE.search(page.read_text(encoding="utf-8")))


SLOW = {"docs/arm.md", "docs/body.md", "docs/haptics.md", "docs/several.md", "docs/stop.md", "docs/watch.md"}
"""Their examples compile boards of their own, or run an arm for seconds."""
NEEDED = {"docs/mujoco.md": ("mujoco",), "docs/ros.md": ("cyclonedds",), "docs/stop.md": ("cyclonedds", "mujoco")}
"""Packages of extras, without which a page is left out."""


class Session(doctest.DocTestParser):
    """A page from top to bottom: Python, and each command or file of Python after ``$ `` whose output follows; ``...``
    stands for any."""

    def parse(self, string, name="<string>"):
        python = r"\1>>> run(r'''\2''')  # doctest: +ELLIPSIS\n"
        command = r"^( *)\$ ((?:contactfpga|python) .*)\n(?= *\S)"
        return super().parse(re.sub(command, python, string, flags=re.MULTILINE), name)


def run(command: str) -> None:
    """A command, in this process; without the spaces with which tables fill their lines."""
    program, *arguments = shlex.split(command)
    with contextlib.redirect_stdout(io.StringIO()) as shown:
        if program == "contactfpga":
            assert cli.main(arguments) == 0
        else:
            run_file(arguments)
    print(re.sub(r" +$", "", shown.getvalue(), flags=re.MULTILINE), end="")


def run_file(arguments: list[str]) -> None:
    """A file of Python, as a program."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.argv", arguments)
        patch.setattr("sys.exit", lambda status=None: status and pytest.fail(f"{arguments}: exit status {status}"))
        runpy.run_path(arguments[0], run_name="__main__")


def examples_of(page: Path) -> doctest.TestResults:
    return doctest.testfile(str(page), module_relative=False, extraglobs={"run": run}, parser=Session())


@pytest.mark.usefixtures("_closed_ports")
@pytest.mark.parametrize("page", sample(PAGES, quick={*PAGES} - SLOW, slow=SLOW))
def test_examples_print_what_they_say(page, tmp_path, monkeypatch):
    for package in NEEDED.get(page, ()):
        pytest.importorskip(package)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "120")
    results = examples_of(ROOT / page)
    assert results.attempted > 0
    assert results.failed == 0


def test_a_command_with_another_output_is_seen(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("    $ contactfpga zones sim://?scene=nothing --once\n    ·...1 zone...\n")
    assert examples_of(page) == doctest.TestResults(failed=1, attempted=1)
    page.write_text(page.read_text().replace("1 zone", "0 zones"))
    assert examples_of(page) == doctest.TestResults(failed=0, attempted=1)


def test_a_file_with_another_output_is_seen(tmp_path):
    file, page = tmp_path / "file.py", tmp_path / "page.md"
    file.write_text("import sys\nprint(sys.argv[1])\nsys.exit(0)")
    page.write_text(f"    $ python {file} one\n    one\n    $ python {file} one\n    two\n")
    assert examples_of(page) == doctest.TestResults(failed=1, attempted=2)


LEFT_OUT = {
    "it needs a board": 'flash, doctor, wire, zones --skin, zones name:, zones PORT, ros /dev/, view "flexitac:',
    "it needs a board, and test_haptics_command.py has a fake one": "haptics zero, haptics threshold",
    "it needs what the reader has; test_mesh.py, test_settling.py": "body surface, settle --skin FILE",
    "it needs certificates; test_net_access.py": "publish --config, zones 'zenoh://left?config",
    "it needs KiCad; test_sheet_kicad.py": "sheet examples/tiles.toml -o build/tiles --kicad",
    "it writes into /tmp; test_virtual_board.py": "board --skin left.toml",
    "it asks a person; test_bringup.py": "bringup",
    "it scores the reader's own file; test_benchmark.py": "study benchmark --scenes",
    "minutes; their own tests": "build, study arm, fit, latency, wave, body examples/robot.toml, view examples/",
}
"""First words of the commands that this test leaves out, by the reason."""
LEFT = tuple(one for words in LEFT_OUT.values() for one in words.split(", "))
SHELL = re.compile(r"^    (?:\.venv/bin/)?contactfpga (.+?)(?: {2,}#.*)?$", re.MULTILINE)
COMMANDS = {str(page.relative_to(ROOT)): SHELL.findall(page.read_text(encoding="utf-8")) for page in ALL_PAGES}
RUN = {page: [one for one in found if not one.startswith(LEFT)] for page, found in COMMANDS.items()}
UNTIL_CTRL_C = ("zones", "view", "ros", "publish")
EARLIER = {"docs/view.md": ["record touches.mcap sim:// --seconds 0.1"]}
"""What the reader of a page has done before."""
PRINTED = [page for page, found in RUN.items() if found]
LONG = {
    "docs/recordings.md",
    "docs/ip.md",
    "docs/view.md",
    "docs/cell.md",
    "docs/soft.md",
    "docs/levels.md",
    "docs/benchmark.md",
}
"""Their commands take longer than those of all others: they write Verilog, export a recording, load the view, and draw
the benchmark."""


def test_what_is_left_out_is_on_a_page():
    printed = [one for commands in COMMANDS.values() for one in commands]
    assert [left for left in LEFT if not any(one.startswith(left) for one in printed)] == []


@pytest.mark.parametrize("page", [page for page, found in COMMANDS.items() if found])
def test_printed_commands_have_words_that_the_parser_takes(page):
    for command in COMMANDS[page]:
        words = shlex.split(command.removesuffix("&"), comments=True)
        assert "--help" in words or cli._parser().parse_args(words).command


@pytest.mark.parametrize("page", sample(PRINTED, quick={"docs/net.md"}, slow={*PRINTED} - LONG))
def test_commands_without_output_run_as_printed(page, tmp_path):
    """One after the other; what runs until Ctrl-C does so until the page's end, and shows something."""
    for package in ("mcap", "viser", "zenoh", "cyclonedds"):
        pytest.importorskip(package)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    (tmp_path / "my.toml").write_text(contactfpga.Skin(release_us=17.0).to_toml())
    variables = environment(BROWSER="true", XDG_RUNTIME_DIR=".")  # no window, and a socket of its own
    with contextlib.ExitStack() as stack:
        running = {}
        for command in EARLIER.get(page, []) + RUN[page]:
            program = ["-c", PATIENCE + PUBLISHER] if page == "docs/net.md" else ["-m", "contactfpga"]
            words = [sys.executable, *program, *shlex.split(command)]
            options = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "cwd": tmp_path, "preexec_fn": listening}
            process = running[command] = subprocess.Popen(words, **options, env=variables)
            stack.callback(process.kill)  # none outlives a test that fails
            if command.startswith(UNTIL_CTRL_C):
                assert any(b": building " not in line for line in process.stdout)  # a Ctrl-C may not meet the build
            else:
                del running[command]
                said, _ = process.communicate(timeout=600)
                assert process.returncode == 0, said
        for command, process in reversed(running.items()):
            assert process.poll() is None, command
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=60)
            assert process.returncode == 0, command


def documented(page: str) -> set[str]:
    """Names that the directives of the interface's pages take: one by one, or all of a module that are its own."""
    found = set(re.findall(r"^\.\. auto(?:class|function):: (\S+)$", page, re.MULTILINE))
    for module in re.findall(r"^\.\. automodule:: (\S+)\n   :members:$", page, re.MULTILINE):
        values = vars(importlib.import_module(module)).items()
        found |= {f"contactfpga.{name}" for name, value in values if getattr(value, "__module__", None) == module}
    return found


def test_the_interface_pages_have_every_public_name():
    page = "\n".join(page.read_text(encoding="utf-8") for page in ALL_PAGES if page.name in GENERATED)
    names = {f"contactfpga.{name}" for name in contactfpga.__all__}
    assert names - documented(page) == {"contactfpga.__version__"}
    assert "contactfpga.__version__" in page


GROUPS = ["Start", "Guide", "Hardware", "Reference", "Internals", "Evidence"]


def test_each_page_is_in_one_group_of_the_index():
    index = (ROOT / "docs/index.md").read_text(encoding="utf-8")
    assert re.findall(r"^## (.*)", index, re.MULTILINE) == GROUPS
    rows = re.findall(r"^\| \[.+\]\((\S+)\) \| \S.+ \|$", index, re.MULTILINE)
    assert sorted(rows) == sorted(path.name for path in (ROOT / "docs").glob("*.md") if path.name != "index.md")


@pytest.mark.parametrize("page", ALL_PAGES, ids=lambda path: path.name)
def test_links_lead_to_files(page):
    links = re.findall(r"\]\(([^)#\s]+)[^)]*\)", words(page))
    assert {link for link in links if "://" not in link and not (page.parent / link).exists()} == set()


def words(page: Path) -> str:
    """A page without comments and without what commands write into it."""
    text = page.read_text(encoding="utf-8")
    text = re.sub(r"<!-- (?:figures|pins): \w+(?: of \w+)? -->.*?<!-- end -->", "", text, flags=re.DOTALL)
    return re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)


@pytest.mark.parametrize("page", [page for page in ALL_PAGES if page.name not in GENERATED], ids=lambda path: path.name)
def test_a_page_is_plain_markdown(page):
    """Hosts of repositories show directives and targets of Sphinx as code, and no links to them."""
    text = page.read_text(encoding="utf-8")
    assert [line for line in text.splitlines() if SPHINX.search(line)] == []


SPHINX = re.compile(r"^\s*(?:`{3,}|:{3,}|~{3,}) *\{|^\([\w-]+\)= *$|(?<!`)\{[a-z]+\}`|^%|^\+{3}")


@pytest.mark.parametrize("page", ALL_PAGES, ids=lambda path: path.name)
def test_links_into_pages_lead_to_headings(page):
    """By the rule of GitHub, whose names of headings Sphinx makes, too."""
    links = re.findall(r"\]\(((?:\w[\w./-]*\.md)?)#([^)\s]+)\)", page.read_text(encoding="utf-8"))
    found = {name: headings(page.parent / name if name else page) for name in {name for name, _ in links}}
    wrong = {f"{name}#{place}" for name, place in links if place not in found[name] and name not in GENERATED}
    assert wrong == set()


def headings(page: Path) -> set[str]:
    """The names by which a page's headings are linked to."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    heads = [re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", head) for head in re.findall(r"^#+ (.*)", text, re.MULTILINE)]
    return {re.sub(r"[^\w\- ]", "", head.strip().lower()).replace(" ", "-") for head in heads}


@pytest.mark.parametrize("page", ALL_PAGES, ids=lambda path: path.name)
def test_files_that_are_named_exist(page):
    named = re.findall(r"`((?:py|hdl|sim|tests|examples|scripts|constraints)/[\w./-]*)`", words(page))
    assert [name for name in named if not (ROOT / name).exists()] == []


@pytest.mark.parametrize("page", ALL_PAGES, ids=lambda path: path.name)
def test_modules_that_are_named_exist(page):
    named = re.findall(r"\b(contactfpga(?:_hdl|_sim)\.[\w.]*\w|(?<=python -m )contactfpga[\w.]*\w)", words(page))
    assert [name for name in named if not there(name)] == []


def there(name: str) -> bool:
    """Whether this is a module, or something in one."""
    module, _, last = name.rpartition(".")
    try:
        return importlib.util.find_spec(name) is not None or hasattr(importlib.import_module(module), last)
    except ModuleNotFoundError:
        return bool(module) and hasattr(importlib.import_module(module), last)


@pytest.mark.parametrize("page", ALL_PAGES, ids=lambda path: path.name)
def test_one_word_for_a_thing(page):
    """Zones have barycenters; `centroid_mm` and one `barycenter (centroid)` are for those who look for that name."""
    text = re.sub(r"(barycenters?) \(centroids?\)", r"\1", words(page), count=1, flags=re.IGNORECASE)
    assert re.findall(r"centroid(?!_mm\b)|\bbehind\b|\banew\b", text, flags=re.IGNORECASE) == []


SPELLED = (".py", ".md", ".toml", ".cff", ".h", ".cpp", ".svg")
# The change log tells old names.
UNSPELLED = (ROOT / "CHANGELOG-0.2.md", Path(__file__).resolve())
BRITISH = re.compile(
    r"(?:behavi|col|fav|flav|harb|hon|neighb|vap)our|\b(?:cent|kilomet|lit|millimet|met)re[ds]?\b|\bgrey\b"
    r"|(?:character|emphas|general|initial|linear|maxim|minim|modern|motor|normal|optim|organ|parallel|parametr|priorit"
    r"|quant|random|real|recogn|serial|special|stabil|summar|synchron|synthes|token|util|visual)is(?:e[drs]?|ing|ation)"
    r"|analyse|(?:model|signal|travel)l(?:ed|ing)|catalogued|defence|licence|towards|whilst",
    re.IGNORECASE,
)


@pytest.mark.parametrize("folder", [".", "py", "hdl", "sim", "scripts", "tests", "docs", "examples"])
def test_spelling_is_american(folder):
    """In names, comments, messages, pages and pictures."""
    files = (ROOT / folder).glob("*.*") if folder == "." else (ROOT / folder).rglob("*.*")
    texts = {path: path.read_text(encoding="utf-8") for path in files if path.suffix in SPELLED}
    assert texts
    words = {path: {*re.findall(r"[^\W\d]\w+", text)} for path, text in texts.items() if path not in UNSPELLED}
    found = {path: sorted({*BRITISH.findall(" ".join(one))}) for path, one in words.items()}
    assert {str(path.relative_to(ROOT)): british for path, british in found.items() if british} == {}


PACKAGES = ("hdl/contactfpga_hdl", "sim/contactfpga_sim", "py/contactfpga")


def folders(pattern: str) -> list[tuple[str, Path]]:
    """Each package, and each of its folders that fit the pattern."""
    return [(name, path.parent) for name in PACKAGES for path in sorted((ROOT / name).glob(f"{pattern}/__init__.py"))]


@pytest.mark.parametrize(("package", "folder"), folders("*"), ids=str)
def test_each_folder_of_a_package_is_in_the_picture(package, folder):
    assert f">{folder.name}</text>" in (ROOT / "docs/images/rooms.svg").read_text(encoding="utf-8")


LEAVES = [
    (package, folder)
    for package, folder in [*folders("*"), *folders("*/*")]
    if not list(folder.glob("*/__init__.py")) and not {"lab", "commands"} & {folder.parent.name}
]


@pytest.mark.parametrize(("package", "folder"), LEAVES, ids=str)
def test_each_folder_is_in_the_architecture(package, folder):
    section = words(ROOT / "docs/architecture.md").partition(f"`{package}`\n")[2].partition("\n## ")[0]
    name = folder.relative_to(ROOT / package).as_posix()
    assert re.search(rf"^\| (`[\w/]+`, )?`{name}`", section, re.MULTILINE)
