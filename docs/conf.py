"""Sphinx configuration."""

import re
import sys
from pathlib import Path
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.ext.napoleon import Config, GoogleDocstring
from sphinx.writers.html5 import HTML5Translator

from contactfpga import __version__
from contactfpga.helptext import HEAD

sys.path.append(str(Path(__file__).parent / "try"))
import assemble

project = "contactfpga"
copyright = "the contactfpga authors"
extensions = ["myst_parser", "sphinx.ext.autodoc"]
myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_heading_anchors = 3
html_theme = "furo"
html_title = f"contactfpga {__version__}"
html_static_path = ["_static"]
html_css_files = ["pages.css"]
html_math_renderer = "mathml"
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
maximum_signature_line_length = 120
exclude_patterns = ["_build"]
nitpicky = False
suppress_warnings = ["ref.python"]  # types such as bytes are looked up among attributes of that name, too
smartquotes = False  # would make a dash that no shell takes of the -- in --host-us


def inline_math(translator: HTML5Translator, node: nodes.math) -> None:
    """A formula in MathML, which browsers draw by themselves: no script, no network, no pictures."""
    translator.body.append(convert(node.astext()))
    raise nodes.SkipNode


def block_math(translator: HTML5Translator, node: nodes.math_block) -> None:
    """The same on lines of its own."""
    translator.body.append(f'<div class="formula">{convert(node.astext(), display="block")}</div>\n')
    raise nodes.SkipNode


def read_sections(app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Arguments of functions and classes. Docstrings of attributes are sentences: napoleon would take what comes before
    their first colon for a type, and show it last. Fields of a class have entries of their own."""
    if what == "class" and HEAD in lines:
        del lines[lines.index(HEAD) :]
    if what not in ("attribute", "data", "property"):
        lines[:] = GoogleDocstring(list(lines), Config(), None, what, name, obj, options).lines()


def group_pages(app: Sphinx, name: str, source: list[str]) -> None:
    """The sidebar from the tables of the index: each of its sections is a group, with the pages that its rows begin
    with. So the index is plain Markdown, which a repository's browser shows as well."""
    if name == "index":
        for section in re.split(r"^## ", source[0], flags=re.MULTILINE)[1:]:
            pages = re.findall(r"^\| \[[^]]*\]\((\w+)\.md\)", section, re.MULTILINE)
            lines = [":hidden:", f":caption: {section.splitlines()[0]}", "", *pages]
            source[0] += "\n".join(["\n```{toctree}", *lines, "```\n"])


def write_try(app: Sphinx, error: Exception | None) -> None:
    """The page that runs a board in the browser, beside the others; it is one file."""
    if error is None and app.builder.format == "html":
        (Path(app.outdir) / "try.html").write_text(assemble.page(), encoding="utf-8")


def setup(app: Sphinx) -> None:
    app.connect("source-read", group_pages)
    app.connect("build-finished", write_try)
    app.connect("autodoc-process-docstring", read_sections)
    app.add_html_math_renderer("mathml", (inline_math, None), (block_math, None))
