"""Sphinx configuration."""

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.writers.html5 import HTML5Translator

project = "contactfpga"
copyright = "the contactfpga authors"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_heading_anchors = 3
html_theme = "furo"
html_title = "contactfpga"
html_static_path = ["_static"]
html_css_files = ["pages.css"]
html_math_renderer = "mathml"
autodoc_member_order = "bysource"
autodoc_typehints = "description"
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


def setup(app: Sphinx) -> None:
    app.add_html_math_renderer("mathml", (inline_math, None), (block_math, None))
