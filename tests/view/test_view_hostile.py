"""Names of files, links and Skins from strangers: the view and pictures show them, and run and load nothing."""

import json

import pytest
from fake_board import wait_until
from recorded_stream import StreamPort
from sample import sample
from two_links import FLAT, ROBOT, ROUND, write_robot

pytest.importorskip("viser")

from contactfpga.recordings import Recording, Session
from contactfpga.robot.body import robot_texts
from contactfpga.tools import cli
from contactfpga.tools.view import opening
from contactfpga.tools.view.panel import as_markdown
from contactfpga_sim.lab import browser

SCRIPT = "parent.document.title = parent.hostile = 'ran'"
HOSTILE = [
    f'<iframe srcdoc="<script>{SCRIPT}</script>"></iframe>',
    '<img src=x onerror="window.hostile = 1">',
    "![a](secret.png)",
    "![b](/etc/hostname)](x)",
    "[c](javascript:window.hostile=1)",
    "www.example.com http://example.com a@example.com <http://example.com>",
    "**bold** _it_ `code` ~~gone~~ # head | a | b | &lt;b&gt; {1 + 1} \\ $x^2$",
    "- list\n- list\n\n    code\n\n---\n1. one",
]


@pytest.mark.parametrize("name", HOSTILE)
def test_markdown_shows_a_name_as_it_is_written(name):
    markdown_it = pytest.importorskip("markdown_it")
    page = markdown_it.MarkdownIt("gfm-like", {"linkify": False}).parse(as_markdown([(name, name)]))
    (inline,) = [token for token in page if token.type == "inline"]
    assert [token.type for token in page] == ["paragraph_open", "inline", "paragraph_close"]
    assert {child.type for child in inline.children} <= {"text", "text_special", "strong_open", "strong_close"}
    assert inline.content.strip().startswith("**")
    shown = "".join(child.content for child in inline.children)
    assert shown == f"{' '.join(name.split())} {' '.join(name.split())}"
    assert "![" not in as_markdown([(name, name)]), "viser would load that picture from this computer"


def record(folder, name):
    """A robot whose links have hostile names, in a file with this name."""
    robot = write_robot(folder)
    links = {"arm": f"{name}{HOSTILE[0]}", "chest": f"{name}{HOSTILE[2]}{HOSTILE[1]}"}
    text = ROBOT
    for plain, hostile in links.items():
        frame = "" if plain == "chest" else 'frame = "arm"\n'
        text = text.replace(f'name = "{plain}"\n', f"name = {json.dumps(hostile)}\n{frame}")
    robot.write_text(text)
    file = folder / f"{name}<img src=x onerror=hostile=1>$x$.mcap"
    ports = {links["arm"]: StreamPort(ROUND, frames=100), links["chest"]: StreamPort(FLAT, frames=100)}
    with Session(file, bytes_only=True, about={"robot": robot_texts.pack(robot)}) as session:
        for link, port in ports.items():
            session.add(port, name=link)
        session.start()
        wait_until(lambda: session.wait(0.005) or not any(port.left for port in ports.values()))
    return file, links


def test_a_notebook_shows_names_as_they_are_written(tmp_path):
    file, _ = record(tmp_path, "n")
    shown = Recording(file)._repr_html_()
    assert "<iframe" not in shown
    assert "<img" not in shown
    assert "&lt;iframe" in shown


def test_a_picture_takes_a_name_with_dollar_signs(tmp_path):
    file, links = record(tmp_path, "$\\frac{")
    assert cli.main(["plot", str(file), "--link", links["chest"], "--output", str(tmp_path / "a.svg")]) == 0
    assert (tmp_path / "a.svg").stat().st_size > 10_000


@pytest.mark.slow  # the browser draws with the processor
@pytest.mark.skipif(browser.program() is None, reason="no Chromium is installed")
@pytest.mark.parametrize("which", sample(["robot", "link"], quick=["robot"]))
def test_a_browser_runs_and_loads_nothing(tmp_path, which):
    pytest.importorskip("playwright")
    file, links = record(tmp_path, "h")
    (tmp_path / "secret.png").write_bytes(b"not to be read")
    named = opening.ViewRequest(str(file), link=links["arm"] if which == "link" else None)
    # The window is small because the processor draws it.
    with opening.opened(named, http_port=0) as shown, browser.visit(shown, 640, 400) as visitor:
        asked = []
        visitor.page.on("request", lambda request: asked.append(request.url))
        visitor.page.wait_for_timeout(3000)
        wait_until(lambda: "</iframe>" in visitor.page.inner_text("body"), pause_s=0.1)
        assert visitor.page.evaluate("window.hostile") is None
        assert visitor.page.title() != "ran"
        assert visitor.page.locator("iframe").count() == 0
        assert visitor.page.locator("img[src='x']").count() == 0
        local = ("data:", "blob:", shown.url.partition("?")[0])
        assert [url for url in asked if not url.startswith(local)] == []
