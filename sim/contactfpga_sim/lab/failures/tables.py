"""The table in docs/failures.md."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from contactfpga.inputs.files import write_text
from contactfpga_sim.lab import writer
from contactfpga_sim.lab.failures import knob_pictures
from contactfpga_sim.lab.failures.catalogue import STUDIES
from contactfpga_sim.lab.failures.knob import Study, Turned
from contactfpga_sim.lab.pool import progress

HEAD = ("knob", "method", "holds until", "breaks at", "what breaks", "what the system says", "what helps")


def table(turned: Mapping[str, Mapping[str, Turned]]) -> str:
    """A row for each method of each study, by the study's name."""
    return writer.table(HEAD, [line for name, methods in turned.items() for line in rows(STUDIES[name], methods)])


def rows(study: Study, methods: Mapping[str, Turned], pictured: bool = True) -> list[str]:
    """A study's lines; what they have in common is said in the first one. ``pictured``: the page has its picture."""
    title = f"[{study.title}](#{study.name})" if pictured else study.title
    lines = []
    for number, (method, turned) in enumerate(methods.items()):
        knob = f"{title}: {study.knob}" if number == 0 else ""
        helps = study.helps if number == 0 else ""
        lines.append(writer.line((knob, method, *_cells(study, turned), helps)))
    return lines


def _cells(study: Study, turned: Turned) -> list[str]:
    holds = "" if turned.holds_until is None else study.format.format(turned.holds_until)
    if turned.broken is None:
        return [f"{holds}, all there are", "", "nothing", ""]
    at = study.format.format(turned.breaks_at)
    return [holds or "nowhere", f"**{at}**", turned.outcomes[turned.broken].what, says(study, turned)]


def says(study: Study, turned: Turned) -> str:
    """What tells the user at the break, before it, and whether something passes unnoticed later."""
    assert turned.broken is not None
    told = turned.outcomes[turned.broken].told
    parts = [", ".join(f"`{word}`" for word in told) if told else "**not noticed**"]
    if turned.warns_at is not None:
        words = ", ".join(f"`{word}`" for word in turned.outcomes[turned.values.index(turned.warns_at)].told)
        since = f"from {study.format.format(turned.warns_at)} on"
        parts = [f"{parts[0]}, {since}"] if words == parts[0] else [*parts, f"{words} {since}"]
    if told and turned.silent_at is not None:
        parts.append(f"**not noticed** at {study.format.format(turned.silent_at)}")
    if not told and (later := [value for value, one in zip(turned.values, turned.outcomes) if one.verdict == "told"]):
        first = turned.outcomes[turned.values.index(later[0])].told
        parts.append(f"{', '.join(f'`{word}`' for word in first)} from {study.format.format(later[0])} on")
    return "; ".join(parts)


UNNOTICED = ("knob", "where", "why nothing reports it")


def unnoticed(turned: Mapping[str, Mapping[str, Turned]]) -> str:
    """A row for each study in which something wrong passes unnoticed, with the reason."""
    lines = []
    for name, methods in turned.items():
        where = [method for method, found in methods.items() if found.silent_at is not None]
        if where:
            study = STUDIES[name]
            lines.append(writer.line((f"[{study.title}](#{name})", ", ".join(where), study.unnoticed)))
    return writer.table(UNNOTICED, lines)


def tables(turned: Mapping[str, Mapping[str, Turned]]) -> writer.Tables:
    """All sections of the page, by name."""
    return {"failures": lambda: table(turned), "unnoticed": lambda: unnoticed(turned), "pictures": pictures}


def pictures() -> str:
    """A heading and a picture for each study."""
    return "\n".join(
        f"({study.name})=\n\n![{study.title}](images/failures/{study.name}.svg)\n" for study in STUDIES.values()
    )


def compute() -> dict[str, dict[str, Turned]]:
    """Every knob turned until something breaks."""
    turned: dict[str, dict[str, Turned]] = {}
    turn(list(STUDIES), turned)
    return turned


def turn(names: Sequence[str], turned: dict[str, dict[str, Turned]]) -> None:
    """Turn the knobs one after another; each is in ``turned`` as soon as it is done."""
    runs = sum(len(STUDIES[name].runs) for name in names)
    with progress() as step:
        for name in names:
            STUDIES[name].turn(lambda: step("knobs and methods", runs), turned.setdefault(name, {}))


def draw(folder: Path, turned: Mapping[str, Mapping[str, Turned]]) -> list[Path]:
    """A picture for each knob, in a folder of their own."""
    (folder / "failures").mkdir(exist_ok=True)
    drawn = []
    for name, methods in turned.items():
        drawn.append(folder / "failures" / f"{name}.svg")
        write_text(drawn[-1], knob_pictures.svg(STUDIES[name], methods))
    return drawn
