"""A cache of results, keyed by their inputs."""

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
    """Key of a module's results for Skins: the module with its imports, without docstrings, and the Skins with their
    choices."""
    code = sources.digest(module, documented=False)
    key = (code, *((skin.to_toml(), sources.own(own_files(skin))) for skin in skins))
    return hashlib.sha256(repr(key).encode()).hexdigest()


def _path(kind: str, key: str) -> Path:
    return ready(cache_folder()) / f"kept-{kind}-{hashlib.sha256(key.encode()).hexdigest()[:32]}.json"


def cached(kind: str, key: str, new: Callable[[], Any]) -> Any:
    """The cached value of ``new()``, which must be plain JSON."""
    path = _path(kind, key)
    if whole(path, tell=True):
        return json.loads(path.read_text())
    value = json.loads(json.dumps(new()))
    if sources.changed():  # while it was worked out, so nobody can say by which code
        return value
    with scratch(path.parent, "unkept") as work:
        (work / "value").write_text(json.dumps(value))
        put(work / "value", path)
    return value
