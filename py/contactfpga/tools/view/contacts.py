"""Descriptions of contacts, on the sheet and in the panel's table."""

from __future__ import annotations

import dataclasses
import html
import math
from collections.abc import Iterable, Sequence

from contactfpga.tools.view.sources import Moment
from contactfpga.tracking.tracks import Track
from contactfpga.zones.zone import Zone

MOST = 8


@dataclasses.dataclass(frozen=True)
class Row:
    """One contact, or a zone without a track."""

    id: int | None
    x_mm: float | None
    """None: the zone surrounds the limb."""
    y_mm: float | None
    area_mm2: float
    area_cells: int
    age_s: float | None
    force_n: float | None = None
    link: str = ""
    pressure: float | None = None

    @property
    def place(self) -> str:
        if self.y_mm is None or math.isnan(self.y_mm):
            return "nowhere"
        return f"{'all round' if self.x_mm is None else f'{self.x_mm:.1f}'}, {self.y_mm:.1f}"

    @property
    def name(self) -> str:
        return f"{self.link} {'' if self.id is None else f'#{self.id}'}".strip()

    @property
    def lines(self) -> tuple[str, str]:
        parts = [f"{self.area_mm2:,.0f} mm²"]
        parts += [] if self.age_s is None else [f"{self.age_s:.1f} s"]
        parts += [] if self.force_n is None else [f"{self.force_n:.1f} N"]
        parts += [] if self.pressure is None else [f"level {self.pressure:.1f}"]
        return f"{self.name}   {self.place} mm".strip(), "   ".join(parts)


def rows(moment: Moment, link: str = "") -> list[Row]:
    """Rows of a moment's contacts by id, then of zones without one."""
    found = [_row(track.zone, link, track, moment) for track in moment.tracks.active]
    return found + [_row(zone, link) for zone in moment.tracks.unsure]


def _row(zone: Zone, link: str, track: Track | None = None, moment: Moment | None = None) -> Row:
    number = age_s = force_n = None
    if track is not None and moment is not None:
        number, age_s = track.id, max(0.0, (moment.tracks.time_us - track.since_us) / 1e6)
        force_n = force_at(zone, moment.pushes)
    return Row(number, zone.x_mm, zone.y_mm, zone.area_mm2, zone.area_cells, age_s, force_n, link, zone.pressure)


def force_at(zone: Zone, pushes: Sequence[tuple[Zone, float | None]]) -> float | None:
    """The push of the nearest measured zone within this zone's width, as the measurement is some milliseconds older."""
    if zone.x_mm is None or zone.y_mm is None:
        return None
    away = [(math.hypot((o.x_mm or 0.0) - zone.x_mm, (o.y_mm or 0.0) - zone.y_mm), n) for o, n in pushes]
    nearest, push = min(away, key=lambda each: each[0], default=(math.inf, None))
    return push if nearest <= 2 * math.sqrt(zone.area_mm2 / math.pi) else None


def table(found: Sequence[Row], no_data: bool = False) -> str:
    """HTML of the table, with names of links escaped, which come from strangers."""
    if no_data:
        return _framed("No data", "")
    count = len(found)
    head = "Nothing touches" if not count else f"{count} contact{'' if count == 1 else 's'}"
    if not count:
        return _framed(head, "")
    columns = {"": [row.name for row in found], "x, y in mm": [row.place for row in found]}
    columns |= {"mm²": [f"{row.area_mm2:,.0f}" for row in found], "age, s": _tenths([row.age_s for row in found])}
    for name, values in (("N", [row.force_n for row in found]), ("level", [row.pressure for row in found])):
        if any(value is not None for value in values):
            columns[name] = _tenths(values)
    body = "".join(_line("td", texts) for texts in zip(*columns.values(), strict=True))
    return _framed(head, f'<table class="contacts"><thead>{_line("th", columns)}</thead><tbody>{body}</tbody></table>')


def _tenths(values: Iterable[float | None]) -> list[str]:
    return ["" if value is None else f"{value:.1f}" for value in values]


def _line(tag: str, texts: Iterable[str]) -> str:
    return f"<tr>{''.join(f'<{tag}>{html.escape(text)}</{tag}>' for text in texts)}</tr>"


def _framed(head: str, inner: str) -> str:
    return f'<div class="contact-list"><b>{head}</b>{inner}</div>'
