"""How the interface's page shows docstrings."""

import importlib.util
from pathlib import Path

import pytest

pytest.importorskip("sphinx")
pytest.importorskip("latex2mathml")

CONF = Path(__file__).resolve().parents[2] / "docs/conf.py"


@pytest.fixture(scope="module")
def conf():
    spec = importlib.util.spec_from_file_location("docs_conf", CONF)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("what", ["attribute", "data", "property"])
def test_a_sentence_about_an_attribute_keeps_its_order(conf, what):
    lines = ["``always``: every frame; ``on_change``: a frame whose cells differ.", ""]
    shown = list(lines)
    conf.read_sections(None, what, "contactfpga.Skin.send", None, {}, shown)
    assert shown == lines


def test_arguments_of_a_function_become_a_list(conf):
    shown = ["Open it.", "", "Args:", "    port: Its name.", ""]
    conf.read_sections(None, "function", "contactfpga.open", None, {}, shown)
    assert shown == ["Open it.", "", ":param port: Its name.", ""]


def test_no_other_reader_of_docstrings_is_loaded(conf):
    assert conf.extensions == ["myst_parser", "sphinx.ext.autodoc"]
