"""Results that are kept by what they were made of, so that nothing is worked out twice."""

from __future__ import annotations

import functools
import hashlib
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import contactfpga
import contactfpga_hdl
import contactfpga_sim
from contactfpga.choices.choice import own_files
from contactfpga.skin import Skin
from contactfpga_sim.board.cache import FILE_MODE, cache_folder, ready, scratch, trusted

_PACKAGES = (contactfpga, contactfpga_hdl, contactfpga_sim)


def sources(skin: Skin | None = None) -> str:
    """Digest of all our own code, gateware included; with a Skin also of the Skin, and of what it chooses from
    elsewhere."""
    digest = hashlib.sha256(_own().encode())
    if skin is not None:
        digest.update(skin.to_toml().encode())
        for path in sorted(own_files(skin)):
            digest.update(path.read_bytes())
    return digest.hexdigest()


@functools.cache
def _own() -> str:
    digest = hashlib.sha256()
    for package in _PACKAGES:
        root = Path(str(package.__file__)).parent
        for path in sorted(path for path in root.rglob("*") if path.suffix in (".py", ".cpp", ".h")):
            digest.update(f"{path.relative_to(root.parent)}\0".encode() + path.read_bytes())
    return digest.hexdigest()


def found(kind: str, key: str) -> Any:
    """What is kept for a key, None if nothing is."""
    path = _path(kind, key)
    return json.loads(path.read_text()) if trusted(path) else None


def _path(kind: str, key: str) -> Path:
    return ready(cache_folder()) / f"kept-{kind}-{hashlib.sha256(key.encode()).hexdigest()[:32]}.json"


def kept(kind: str, key: str, new: Callable[[], Any]) -> Any:
    """What ``new()`` gives, or what it gave before for the same key; it must be plain JSON."""
    if (before := found(kind, key)) is not None:
        return before
    path = _path(kind, key)
    value = json.loads(json.dumps(new()))
    # Whole or not at all, whoever else writes it at the same time.
    with scratch(path.parent, "unkept") as work:
        (work / "value").write_text(json.dumps(value))
        (work / "value").chmod(FILE_MODE)
        os.replace(work / "value", path)
    return value
