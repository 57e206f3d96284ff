"""Tables of docs/safety.md."""

from __future__ import annotations

from contactfpga_sim.lab import writer
from contactfpga_sim.lab.safety import compute, trial
from contactfpga_sim.lab.safety.catalogue import FAULTS
from contactfpga_sim.lab.safety.compute import Place

OPTIONS: dict[str, tuple[str, tuple[str, ...]]] = {
    "none": ("plain", ("flags",)),
    "a deadline for each read": ("plain", ("flags", "deadline")),
    "`guard`": ("guarded", ("flags",)),
    "`guard` and a deadline": ("guarded", ("flags", "deadline")),
    "`guard` and `alive`": ("guarded", ("flags", "alive")),
    "`guard`, `alive` and a deadline": ("guarded", ("flags", "deadline", "alive")),
    "these and `self_test`": ("guarded", ("flags", "deadline", "alive", compute.HOST)),
}
NAMES = {"flags": "the frame's flag", "deadline": "no frame", "alive": "`alive` stops"}


SHOWN = ("broken row", "closed switch", "dead switch", "shorted diode", "dead board", "broken contact")
"""Faults that the page shows."""


def faults_table() -> writer.Table:
    columns = ("fault", "reported by", "worst detection time", "what you must do")
    effects = ("time until `contact` rises", "wrong frames before detection", "without options")
    rows = []
    for name, fault in FAULTS.items():
        guarded, plain = _harmful("guarded", name), _harmful("plain", name)
        rows.append(
            [
                fault.title,
                fault.effect,
                _told_by(guarded, fault.host) + _tested(name),
                _after(guarded, ("flags", "deadline", "alive")),
                _after(guarded, ("contact",)) if _is_told(guarded) else "",
                str(max(place.wrong for place in guarded)) if _is_told(guarded) else "all",
                _count(plain, ("flags",)),
                fault.left,
            ]
        )
    titles = [FAULTS[name].title for name in SHOWN]
    head = (columns[0], "effect if undetected", *columns[1:3], *effects, columns[3])
    return writer.Table(head, rows, lambda row: row[0] in titles, columns)


def coverage_table() -> str:
    rows = [["options", "faults reported at every place", "share of faults", "places reported"]]
    for name, (skin, channels) in OPTIONS.items():
        counts = [_told(skin, fault, channels) for fault in FAULTS]
        whole = sum(told == of for told, of in counts)
        places, of_places = (sum(count) for count in zip(*counts, strict=True))
        share = f"{100 * whole / len(FAULTS):.0f} %"
        rows.append([name, f"{whole} of {len(FAULTS)}", share, f"{places} of {of_places}"])
    return writer.table_of(rows)


def _told(skin: str, fault: str, channels: tuple[str, ...]) -> tuple[int, int]:
    tested = compute.times_at_start(fault) if compute.HOST in channels else {}
    if not tested:
        return compute.told(skin, fault, channels)
    places = _harmful(skin, fault)
    told = (
        tested[place.name] is not None or any(place.us(channel) is not None for channel in channels) for place in places
    )
    return sum(told), len(places)


def _harmful(skin: str, fault: str) -> list[Place]:
    return [place for place in compute.found(skin, fault) if place.harmful]


def _channels(place: Place) -> dict[str, int]:
    times = {channel: place.us(channel) for channel in NAMES}
    return {channel: us for channel, us in times.items() if us is not None}


def _is_told(places: list[Place]) -> bool:
    return all(_channels(place) for place in places)


def _told_by(places: list[Place], host: str) -> str:
    if not any(_channels(place) for place in places):
        return f"**not reported** by a scan; meant for `{host}`" if host else "**not reported**"
    words = dict.fromkeys(_general(word) for place in places for word in place.words)
    names = NAMES | {"flags": f"{NAMES['flags']} ({', '.join(words)})"}
    said = [names[channel] for channel in NAMES if any(channel in _channels(place) for place in places)]
    some = "" if _is_told(places) else f", at {_count(places, tuple(NAMES))} places"
    return f"{', '.join(said)}{some}"


def _tested(fault: str) -> str:
    times = [us for us in compute.times_at_start(fault).values() if us is not None]
    of = len(compute.times_at_start(fault))
    share = "" if len(times) == of else f" at {len(times)} of {of} places"
    return f"; the self-test, {max(times):.0f} µs after power-up at most{share}" if times else ""


def _general(word: str) -> str:
    """``row 3 open`` as ``row N open``."""
    return " ".join("N" if part.isdigit() else part for part in word.split())


def _count(places: list[Place], channels: tuple[str, ...]) -> str:
    told = sum(any(place.us(channel) is not None for channel in channels) for place in places)
    if told in (0, len(places)):
        return "reported" if told else "not reported"
    return f"{told} of {len(places)}"


def _after(places: list[Place], channels: tuple[str, ...]) -> str:
    times = [[us for channel in channels if (us := place.us(channel)) is not None] for place in places]
    found = [min(one) for one in times if one]
    return f"{max(found):,} µs" if found else ""


def times_table() -> str:
    rows = [["wait", "for"]]
    rows.append([f"{trial.LONGEST_US:,} µs", "a fault that is not reported until then counts as not reported"])
    rows.append([f"{trial.QUIET_US:,} µs", "the watchdog's time without an edge of `alive`"])
    rows.append([f"{trial.DEADLINE_US:,} µs", "the host's deadline for a frame"])
    rows.append([f"{trial.STEP_US} µs", "the grid of the times"])
    return writer.table_of(rows)
