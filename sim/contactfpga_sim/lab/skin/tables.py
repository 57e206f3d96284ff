"""The Skin page's table of fields, from their docstrings."""

from __future__ import annotations

import dataclasses
import json
import re

from contactfpga import helptext
from contactfpga.skin import Skin
from contactfpga_sim.lab import writer

_ROLE = re.compile(r":\w+:`~?([^`]*)`")


def fields_table() -> str:
    """Fields in class order; defaults as in TOML."""
    defaults = {field.name: field.default for field in dataclasses.fields(Skin)}
    told = [field for field in helptext.fields(Skin) if field.name in defaults]
    rows = [(f"`{field.name}`", _toml(defaults[field.name]), _markdown(field.text)) for field in told]
    return writer.table_of([("field", "default", "meaning"), *rows])


def _toml(value: object) -> str:
    return "" if value is None else f"`{json.dumps(value)}`"


def _markdown(text: str) -> str:
    return " ".join(_ROLE.sub(r"`\1`", text).replace("``", "`").split())
