"""What tells two Skins apart, in words."""

from __future__ import annotations

import dataclasses

from contactfpga.skin import Skin
from contactfpga.skin.sheet import Sheet
from contactfpga.wire.hello import Hello


def report_of(sheet: Sheet) -> str:
    """What a board reports."""
    precise = f" of {sheet.barycenter_bits} fraction bits" if sheet.report == "barycenter" else ""
    return f"report {sheet.report!r}{precise}"


def describe(hello: Hello) -> str:
    """The Skin that a board tells of."""
    sheet = hello.sheet
    name = f" named {hello.name!r}" if hello.name else ""
    return (
        f"a {sheet.rows}x{sheet.columns} Skin{name} (fingerprint {hello.fingerprint.hex()}, {report_of(sheet)}, "
        f"connectivity {sheet.connectivity})"
    )


def difference(hello: Hello, expected: Skin) -> str:
    """What a board was built from, and how that differs from the Skin that was expected."""
    told, asked = _facts(hello), _expected_facts(expected)
    differing = [f"{name} is {told[name]}, asked for was {asked[name]}" for name in told if told[name] != asked[name]]
    if differing:
        what = "; ".join(differing)
    else:
        changed = ", ".join(f"{name} = {value!r}" for name, value in expected.changed.items()) or "only default values"
        what = f"the two differ in fields that a hello does not tell; the Skin asked for has {changed}"
    prints = f"fingerprint {hello.fingerprint.hex()}, asked for was {expected.fingerprint.hex()}"
    return f"another Skin: {what} ({prints}); give its own Skin or none, or load the bitstream of this one"


def _facts(hello: Hello) -> dict[str, object]:
    return dataclasses.asdict(hello.sheet) | {"send": hello.send, "clock_hz": hello.clock_hz, "baud": hello.baud}


def _expected_facts(skin: Skin) -> dict[str, object]:
    return dataclasses.asdict(skin.sheet) | {"send": skin.send, "clock_hz": skin.clock_hz, "baud": skin.baud}
