"""Files that come with the package, and pages that do not."""

from __future__ import annotations

import re
from pathlib import Path

PAGES = "https://github.com/contactfpga/contactfpga/blob/main/"
"""Where the pages of the source tree can be read."""
_PAGE = re.compile(r"\bdocs/[\w-]+\.md\b")


def examples() -> Path:
    """Folder of the example files.

    >>> contactfpga.Skin.load(contactfpga.examples() / "icebreaker-64x64.toml").rows
    64
    """
    installed = _package() / "examples"
    return installed if installed.is_dir() else _package().parents[1] / "examples"  # the latter in a source tree


def with_pages(text: str) -> str:
    """The text, in which ``docs/NAME.md`` is an address where there is no such file, as in an installed wheel."""
    if (_package().parents[1] / "docs").is_dir():
        return text
    return _PAGE.sub(lambda page: PAGES + page[0], text)


def _package() -> Path:
    return Path(__file__).resolve().parent
