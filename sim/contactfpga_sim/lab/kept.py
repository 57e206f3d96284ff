"""Results that are kept by what they were made of, so that nothing is worked out twice."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from contactfpga.choices.choice import own_files
from contactfpga.skin import Skin
from contactfpga_sim.model.board import sources
from contactfpga_sim.model.board.cache import cache_folder, put, ready, scratch, whole


def made_by(module: str, *skins: Skin) -> str:
    """Key of what a module works out of Skins, as far as code decides it: the module with all that it imports, and the
    Skins with what they choose from elsewhere."""
    code = (sources.digest(module), *((skin.to_toml(), sources.own(own_files(skin))) for skin in skins))
    return hashlib.sha256(repr(code).encode()).hexdigest()


def found(kind: str, key: str) -> Any:
    """What is kept for a key, None if nothing is."""
    path = _path(kind, key)
    return json.loads(path.read_text()) if whole(path, tell=True) else None


def _path(kind: str, key: str) -> Path:
    return ready(cache_folder()) / f"kept-{kind}-{hashlib.sha256(key.encode()).hexdigest()[:32]}.json"


def kept(kind: str, key: str, new: Callable[[], Any]) -> Any:
    """What ``new()`` gives, or what it gave before for the same key; it must be plain JSON."""
    if (before := found(kind, key)) is not None:
        return before
    path = _path(kind, key)
    value = json.loads(json.dumps(new()))
    if sources.changed():  # while it was worked out, so nobody can say by which code
        return value
    with scratch(path.parent, "unkept") as work:
        (work / "value").write_text(json.dumps(value))
        put(work / "value", path)
    return value
