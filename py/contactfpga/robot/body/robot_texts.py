"""A `robot.toml` and its files as texts for a recording."""

from __future__ import annotations

import base64
import binascii
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from contactfpga.inputs import tomlfile
from contactfpga.robot.body import urdf as urdf_file
from contactfpga.robot.body.body import Body
from contactfpga.robot.body.state import BodyError

ROBOT = "robot"
"""Name of the texts in a recording."""
TOML = "toml"
"""Name of the robot's table among the texts."""
FILES = ("skin", "units", "folds", "surface")


def pack(path: str | Path) -> dict[str, str]:
    """Texts by name, of a file that :meth:`Body.load` has read. Raises OSError."""
    path = Path(path)
    text = path.read_text(encoding="utf-8")
    found = {TOML: text}
    for table, key, name in _files(tomlfile.parse(text.encode(), path, BodyError)):
        file = urdf_file.located(table[key], path.parent) if key == "urdf" else path.parent / table[key]
        found[name] = base64.b64encode(file.read_bytes()).decode("ascii")
    return found


def unpack(texts: Mapping[str, str], folder: Path) -> Body:
    """The body from its texts, with files in this folder, which must stay while meshes are needed. Raises
    :class:`BodyError` for texts that are not from :func:`pack`."""
    try:
        values = tomlfile.parse(texts[TOML].encode(), "robot.toml", BodyError)
        for number, (table, key, name) in enumerate(_files(values)):
            file = folder / str(number)
            file.write_bytes(base64.b64decode(texts[name], validate=True))
            table[key] = str(file)
    except KeyError as error:
        raise BodyError(f"the recording does not hold the robot's file {error}") from None
    except (ValueError, TypeError, AttributeError, binascii.Error) as error:
        raise BodyError(f"the recording's robot cannot be read: {error}") from None
    return Body.of(values, folder)


def _files(values: dict[str, Any]) -> Iterator[tuple[dict[str, Any], str, str]]:
    if "urdf" in values:
        yield values, "urdf", "urdf"
    for number, link in enumerate(values.get("links", ())):
        for key in FILES:
            if isinstance(link.get(key), str):
                yield link, key, f"links.{number}.{key}"
