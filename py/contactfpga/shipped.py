"""Example files of the package, and addresses of pages outside the package."""

from __future__ import annotations

import re
from pathlib import Path

PAGES = "https://github.com/contactfpga/contactfpga/blob/main/"
"""Address of the pages of the source tree."""
_PAGE = re.compile(r"\bdocs/[\w-]+\.md\b")


def examples() -> Path:
    """Folder of the example files.

    >>> contactfpga.Skin.load(contactfpga.examples() / "icebreaker-64x64.toml").rows
    64
    """
    installed = _package() / "examples"
    return installed if installed.is_dir() else _package().parents[1] / "examples"  # the latter in a source tree


def with_pages(text: str) -> str:
    """The text with an address in place of each ``docs/NAME.md`` that does not exist, as in an installed wheel."""
    if (_package().parents[1] / "docs").is_dir():
        return text
    return _PAGE.sub(lambda page: PAGES + page[0], text)


def _package() -> Path:
    return Path(__file__).resolve().parent
