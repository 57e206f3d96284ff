"""Files that come with the package."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path


def examples() -> Path:
    """Folder of the example files.

    Load one with ``Skin.load(contactfpga.examples() / "icebreaker-64x64.toml")``.
    """
    package = Path(str(files("contactfpga"))).resolve()
    installed = package / "examples"
    return installed if installed.is_dir() else package.parents[1] / "examples"  # the latter in a source tree
