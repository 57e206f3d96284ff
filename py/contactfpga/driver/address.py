"""Port names, decoded."""

from __future__ import annotations

import dataclasses
import math
import os
import re
import shlex
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from contactfpga.errors import AddressError
from contactfpga.inputs.values import number_in
from contactfpga.skin.several import MOST_SHEETS

NAME, USB = "name:", "usb:"
"""Prefixes of ports that have to be searched (:mod:`contactfpga.driver.finding`)."""
SIM, REPLAY, NET, FLEXITAC = "sim:", "replay://", "zenoh://", "flexitac://"
"""Prefixes of the other addresses."""
MAX_LINKS, MAX_NAME = 64, 256
"""Most links of a robot or of a recording, and most characters of a link's name, which tables repeat in each row."""


def searched(port: object) -> bool:
    return port is None or (isinstance(port, str) and port.startswith((NAME, USB)))


@dataclasses.dataclass(frozen=True)
class Serial:
    device: str


@dataclasses.dataclass(frozen=True)
class Sim:
    """``sim://?scene=NAME&skin=FILE&threshold=NUMBER&units=FILE&sheets=FILE&unplug=SHEET:SECONDS&pace=NUMBER``,
    decoded."""

    scene: str | None = None
    skin: str | None = None
    threshold: float | None = None
    """Number above which a cell of a recorded scene is pressed."""
    units: str | None = None
    """File of pressure units, pressed by the scene."""
    sheets: str | None = None
    unplug: tuple[int, float] | None = None
    """A sheet, and the board's time in s from which it is pulled off; the text has no sheet if there is only one."""
    pace: float | None = None
    """Speed relative to real time; None: time passes only during reads."""

    @classmethod
    def parse(cls, name: str) -> Sim:
        """Decode an address. ``%`` and two hex digits stand for a byte of UTF-8; all other characters except ``&``
        stand for themselves. Raises :class:`AddressError`.
        """
        head, _, query = name.partition("?")
        if head not in ("sim://", "sim:"):
            raise AddressError(f"{name}: {_SIM_FORM}")
        found: dict[str, Any] = {}
        for part in query.split("&") if query else ():
            key, equals, value = part.partition("=")
            if key not in SIM_OPTIONS or not equals:
                raise AddressError(f"{name}: {part!r} is no option; {_SIM_FORM}; {_ESCAPES}")
            if key in found:
                raise AddressError(f"{name}: {key} is given twice")
            found[key] = _decoded(name, value)
            if not found[key]:
                raise AddressError(f"{name}: {key} is empty; {_SIM_FORM}")
        if "threshold" in found:
            found["threshold"] = _threshold(name, found["threshold"])
        if "unplug" in found:
            found["unplug"] = _unplug(name, found["unplug"], "sheets" in found)
        found["pace"] = _pace(name, found.get("pace"), "real time")
        if "sheets" in found and (other := {"skin", "threshold", "units"} & set(found)):
            raise AddressError(
                f"{name}: with sheets there is no {min(other)}; their Skins are in the file of the sheets"
            )
        return cls(**found)


SIM_OPTIONS = tuple(field.name for field in dataclasses.fields(Sim))
_SIM_FORM = (
    "it reads sim://, with ?scene=NAME, &skin=FILE, &threshold=NUMBER, &units=FILE, &unplug=SECONDS and &pace=1 where "
    "wanted"
)
_ESCAPES = "a % that is meant is written %25, a & %26"


def _decoded(name: str, text: str) -> str:
    if odd := re.search(r"%(?![0-9a-fA-F]{2}).{0,2}", text):
        raise AddressError(f"{name}: {odd[0]!r} is no % with two hex digits; {_ESCAPES}")
    try:
        return unquote(text, errors="strict")
    except UnicodeDecodeError:
        raise AddressError(f"{name}: {text!r} is no UTF-8 once its % are decoded") from None


def _threshold(name: str, text: str) -> float:
    value = number_in(text)
    if not math.isfinite(value):
        raise AddressError(f"{name}: threshold is {text!r}; it must be a finite number")
    return value


def _unplug(name: str, text: str, several: bool) -> tuple[int, float]:
    form = "SHEET:SECONDS" if several else "SECONDS"
    number, _, seconds = text.rpartition(":")
    value, sheet = number_in(seconds), number_in(number) if several else 0
    if (number and not several) or not 0 <= value < math.inf or sheet not in range(MOST_SHEETS):
        raise AddressError(f"{name}: unplug is {text!r}; it must be {form}, with 0 or more seconds")
    return int(sheet), value


@dataclasses.dataclass(frozen=True)
class Replay:
    """``replay://FILE?pace=1&start=2.5&link=NAME``, decoded."""

    path: Path
    pace: float | None = None
    """Speed relative to real time; None: as fast as it is read."""
    start_s: float = 0.0
    """Time in s; an MCAP file plays from the last hello before it."""
    link: str | None = None

    @classmethod
    def parse(cls, name: str) -> Replay:
        path, *rest = _REPLAY_OPTIONS.split(name.removeprefix(REPLAY), maxsplit=1)
        found: dict[str, str] = {}
        for part in rest[0].split("&") if rest else ():
            key, equals, value = part.partition("=")
            if not equals or key not in ("pace", "start", "link"):
                raise AddressError(f"{name}: {part!r} is no option; there are {REPLAY_FORM}")
            if key in found:
                raise AddressError(f"{name}: {key} is given twice")
            found[key] = value
        pace = _pace(name, found.get("pace"), "the time of the recording")
        start = number_in(found.get("start", "0"))
        if not 0 <= start < math.inf:
            raise AddressError(f"{name}: start is {found['start']!r}; it must be a number of seconds, 0 or more")
        link = unquote(found["link"]) if "link" in found else None
        try:
            return cls(Path(path).expanduser(), pace, start, link)
        except RuntimeError as error:  # ~nobody
            raise AddressError(f"{name} cannot be opened: {error}") from None


_REPLAY_OPTIONS = re.compile(r"\?(?=(?:pace|start|link)=)")
"""Beginning of the options; the path may contain other question marks."""
REPLAY_FORM = "?pace=1, ?start=SECONDS and ?link=NAME, with & between"


def _pace(name: str, text: str | None, what: str) -> float | None:
    if text is None:
        return None
    value = number_in(text)
    if not 1e-6 <= value <= 1e6:
        raise AddressError(f"{name}: pace is {text!r}; it must be a positive number up to 1e6, 1 for {what}")
    return value


@dataclasses.dataclass(frozen=True)
class Net:
    """``zenoh://KEY?connect=ENDPOINT&config=FILE&wait=SECONDS``, decoded."""

    key: str
    connect: str | None = None
    config: str | None = None
    wait_s: float = 0.5
    """Time in s after which a missing publisher counts as lost."""

    @classmethod
    def parse(cls, name: str) -> Net:
        head, _, query = name.removeprefix(NET).partition("?")
        found: dict[str, str] = {}
        for part in query.split("&") if query else ():
            option, _, value = part.partition("=")
            if option not in ("connect", "config", "wait") or not value or option in found:
                raise AddressError(f"{name}: {part!r} is no option, or given twice; {_NET_FORM}")
            found[option] = unquote(value)
        try:
            key = checked_key(head)
        except ValueError as error:
            raise AddressError(f"{name}: {error}; {_NET_FORM}") from None
        return cls(key, found.get("connect"), found.get("config"), _wait(name, found.get("wait", "0.5")))


_NET_FORM = "it reads zenoh://KEY, with ?connect=ENDPOINT, &config=FILE and &wait=SECONDS where wanted"


def checked_key(key: str) -> str:
    """A key that names one board; raises ValueError for any other."""
    if not re.fullmatch(r"[\w.@:+-]+(/[\w.@:+-]+)*", key) or len(key) > 200:
        raise ValueError(f"key is {key!r}; it must be names of letters, digits and . _ - + : @ with / between them")
    return key


def _wait(name: str, text: str) -> float:
    value = number_in(text)
    if not 0 <= value <= 86_400:
        raise AddressError(f"{name}: wait is {text!r}; it must be a number of seconds from 0 to 86400")
    return value


@dataclasses.dataclass(frozen=True)
class Flexitac:
    """``flexitac://DEVICE?margin=15&frames=20&pitch=3&rows=16&columns=32&baud=2000000``, decoded."""

    device: str
    margin: int = 15
    """Excess over its rest from which a cell is pressed, of 255."""
    frames: int = 20
    """Number of first frames, without touch, that determine the rest."""
    pitch_mm: float = 3.0
    rows: int = 16
    columns: int = 32
    baud: int = 2_000_000

    @classmethod
    def parse(cls, name: str) -> Flexitac:
        device, _, query = name.removeprefix(FLEXITAC).partition("?")
        if not device:
            raise AddressError(f"{name}: it names no device; {_FLEXITAC_FORM}")
        found: dict[str, Any] = {}
        for part in query.split("&") if query else ():
            key, _, text = part.partition("=")
            if key not in FLEXITAC_LIMITS or key in found:
                raise AddressError(f"{name}: {part!r} is no option, or given twice; {_FLEXITAC_FORM}")
            low, high = FLEXITAC_LIMITS[key]
            value = number_in(text)
            whole = key != "pitch"
            if not low <= value <= high or (whole and value != int(value)):
                kind = "a whole number" if whole else "a number"
                raise AddressError(f"{name}: {key} is {text!r}; it must be {kind} from {low:,} to {high:,}")
            found[key] = int(value) if whole else value
        if "pitch" in found:
            found["pitch_mm"] = found.pop("pitch")
        return cls(device, **found)


FLEXITAC_LIMITS: dict[str, tuple[float, float]] = {
    "margin": (1, 255),
    "frames": (1, 1000),
    "pitch": (0.1, 100),
    "rows": (1, 64),
    "columns": (1, 64),
    "baud": (9600, 12_000_000),
}
"""Least and largest value of each option."""
_FLEXITAC_FORM = "it reads flexitac://DEVICE, with " + ", ".join(f"{key}=" for key in FLEXITAC_LIMITS) + " where wanted"


@dataclasses.dataclass(frozen=True)
class SheetOf:
    """``PORT#NUMBER``: one sheet of a board that serves several."""

    port: str
    number: int

    @classmethod
    def parse(cls, name: str) -> SheetOf | None:
        """Decode a name; None if it does not name one sheet. Raises :class:`AddressError`."""
        found = re.fullmatch(r"(.*)#(\d{1,4})", name)
        if found is None:
            return None
        if int(found[2]) >= MOST_SHEETS:
            raise AddressError(f"{name}: sheets have the numbers 0 to {MOST_SHEETS - 1}")
        if (once := re.fullmatch(r"(.*?)(#\d{1,4})+", found[1])) is not None:
            raise AddressError(f"{name}: it names two sheets; give one number, as in {once[1]}#{int(found[2])}")
        return cls(found[1], int(found[2]))


Address = Serial | Sim | Replay | Net | Flexitac | SheetOf


def parse(name: str) -> Address:
    """Decode a port's name. Raises :class:`AddressError`, also for an unsuitable file."""
    if (sheet := SheetOf.parse(name)) is not None:
        return sheet
    if name.startswith(SIM):
        return Sim.parse(name)
    if name.startswith("replay:"):
        return Replay.parse(name)
    if name.startswith(NET):
        return Net.parse(name)
    if name.startswith(FLEXITAC):
        return Flexitac.parse(name)
    if (reason := _no_port(name)) is not None:
        raise AddressError(reason)
    return Serial(name)


def _no_port(name: str) -> str | None:
    if not name:
        return "the port has no name; leave it out to take the board that is plugged in"
    scheme, colon, _ = name.partition("://")
    if colon:
        return f"{name}: {scheme}:// is not known; there are sim://, replay://FILE, zenoh://KEY and flexitac://DEVICE"
    if not os.path.isfile(name):
        return None
    if name.endswith(".toml"):
        return f"{name} is a file; for the boards of a robot there is: contactfpga body {shlex.quote(name)}"
    return f"{name} is a file; to play a recording name {shlex.quote(f'replay://{name}')} as the port"
