"""Score results on the benchmark's scenes: wrong counts, places and times, with 95 % intervals.

    python score.py SCENES RESULTS.npz ...

``SCENES``: folder of the scenes' files, one per family. This file needs Python and numpy alone; copy it to where you
need it. ``docs/benchmark.md`` states both formats. A file is data: nothing in it is run.
"""

from __future__ import annotations

import argparse
import csv
import dataclasses
import io
import math
import sys
import zipfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

MODELS = ("model", "elements")
"""The two models of what presses: that of the cover, and finite elements."""
MOST_BYTES, MOST_FOUND, MOST_WORDS = 1 << 27, 64, 80
"""Limits: bytes of an array, contacts found in a scene, letters of a name."""
Z95 = 1.959963984540054


class ScoreError(Exception):
    """A file cannot be scored: one line."""


class Archive:
    """Arrays of an NPZ file. Their sizes are checked before memory is taken."""

    def __init__(self, path: str | Path):
        self.path = Path(path)
        try:
            with zipfile.ZipFile(self.path) as file:
                self._sizes = {info.filename.removesuffix(".npy"): info for info in file.infolist()}
        except (OSError, zipfile.error) as error:
            raise ScoreError(f"{self.path} is no NPZ file: {error}; write it with numpy.savez_compressed") from None

    def read(self, name: str, kinds: str, shape: Sequence[int | None] = ()) -> np.ndarray:
        """An array with one of these kinds of dtype and this shape; None: any number. Raises :class:`ScoreError`."""
        if name not in self._sizes:
            raise ScoreError(f"{self.path} has no array {name!r}; it has {', '.join(sorted(self._sizes)[:12])}")
        if (size := self._sizes[name].file_size) > MOST_BYTES:
            raise ScoreError(f"{self.path}: {name} has {size:,} bytes; at most {MOST_BYTES:,} are read")
        try:
            with zipfile.ZipFile(self.path) as file, file.open(self._sizes[name]) as opened:
                found = _array(io.BytesIO(opened.read(MOST_BYTES)))
        except (OSError, ValueError, EOFError, zipfile.error, NotImplementedError) as error:
            raise ScoreError(f"{self.path}: {name} cannot be read: {error}") from None
        wanted = tuple(got if want is None else want for want, got in zip(shape, found.shape))
        if found.dtype.kind not in kinds or found.shape != wanted or len(wanted) != len(shape):
            what = f"{name} is {found.dtype} of shape {found.shape}"
            raise ScoreError(f"{self.path}: {what}; it must be of kind {kinds!r} and shape {tuple(shape)}")
        return found


def _array(data: io.BytesIO) -> np.ndarray:
    """An array in NPY format whose head does not promise more than there is."""
    form = np.lib.format
    read = {(1, 0): form.read_array_header_1_0, (2, 0): form.read_array_header_2_0}.get(form.read_magic(data))
    if read is None:
        raise ValueError("a version of the NPY format other than 1.0 and 2.0")
    shape, _, dtype = read(data)
    if math.prod(shape) * max(1, dtype.itemsize) > data.getbuffer().nbytes:
        raise ValueError(f"shape {shape} promises more than its {data.getbuffer().nbytes} bytes")
    data.seek(0)
    return form.read_array(data, allow_pickle=False)


class Entry(NamedTuple):
    """Results of one method."""

    name: str
    kind: str
    """What they are of, such as ``model`` or ``measured``."""
    pitch_mm: float
    """Pitch whose forces it read."""
    places: dict[tuple[str, str], np.ndarray]
    """By family and model: (n, k, 2) x and y in mm of the contacts found in each scene, NaN beyond their number."""
    seconds: dict[str, np.ndarray]
    """By family: (n,) seconds from the touch of the foam to the last byte of the first message with a contact; inf:
    never, NaN: unknown."""


class Truth(NamedTuple):
    """Contacts of the scenes of a family under one model: (n, k, 2) mm, NaN beyond their number."""

    contacts: np.ndarray
    """Contacts that are apart by any gap."""
    joined: np.ndarray
    """Contacts, one across gaps narrower than the foam is thick."""


def truths(folder: str | Path, pitch_mm: float) -> dict[tuple[str, str], Truth]:
    """Truth by family and model of the scenes in a folder."""
    found = {}
    for path in sorted(Path(folder).glob("*.npz")):
        scenes = Archive(path)
        for model in MODELS:
            names = (f"{model}_{pitch_mm:g}mm_{name}" for name in Truth._fields)
            found[path.stem, model] = Truth(*(scenes.read(name, "f", (None, None, 2)) for name in names))
    if not found:
        raise ScoreError(f"{folder} holds no scenes, files that end in .npz; write them first")
    return found


def load(path: str | Path, scenes: str | Path) -> tuple[Entry, dict[tuple[str, str], Truth]]:
    """A file of results, checked, and the truth that it is to be judged by. Raises :class:`ScoreError`."""
    file = Archive(path)
    name, kind = (str(file.read(one, "U")) for one in ("name", "kind"))
    if any(not one.isprintable() or not 0 < len(one) <= MOST_WORDS for one in (name, kind)):
        raise ScoreError(f"{path}: name and kind must have 1 to {MOST_WORDS} printable letters")
    pitch = float(file.read("pitch_mm", "fiu"))
    there, places, seconds = truths(scenes, pitch), {}, {}
    for (family, model), truth in there.items():
        count = len(truth.contacts)
        places[family, model] = at = file.read(f"{family}_{model}", "f", (count, None, 2))
        if at.shape[1] > MOST_FOUND or np.isinf(at).any() or (np.isnan(at[..., 0]) != np.isnan(at[..., 1])).any():
            limit = f"at most {MOST_FOUND} contacts a scene, each with finite x and y, or NaN in both"
            raise ScoreError(f"{path}: {family}_{model} must have {limit}")
        seconds[family] = late = file.read(f"{family}_seconds", "f", (count,))
        if (late < 0).any():
            raise ScoreError(f"{path}: {family}_seconds has {late.min():g}; times count from the touch, from 0 on")
    return Entry(name, kind, pitch, places, seconds), there


@dataclasses.dataclass(frozen=True)
class Interval:
    """A mean with its 95 % interval."""

    mean: float
    low: float
    high: float
    count: int


class Score(NamedTuple):
    """Scores of one family under one model, or of all."""

    wrong: Interval
    """Share of scenes whose number of contacts is neither that with narrow gaps nor that without."""
    apart: Interval
    """Share of scenes whose number is not that of contacts apart by any gap."""
    place_mm: Interval
    """Mean distance from the truth in scenes with a right number."""
    median_s: Interval
    """Median of :attr:`Entry.seconds`."""
    late_s: Interval
    """Their 95 % quantile."""


Scores = dict[tuple[str, str], Score]
"""By family and model; family ``all`` is all scenes."""


def judged(found: np.ndarray, contacts: np.ndarray, joined: np.ndarray) -> tuple[bool, bool, float]:
    """Whether the number of (k, 2) places is wrong, whether it is not the number of contacts apart by any gap, and the
    mean distance of the pairing with the least sum; NaN if the number is wrong. Rows of NaN are no contact."""
    found, contacts, joined = (one[~np.isnan(one[:, 0])] for one in (found, contacts, joined))
    true = contacts if len(found) == len(contacts) else joined
    wrong = not min(len(contacts), len(joined)) <= len(found) <= max(len(contacts), len(joined))
    return wrong, len(found) != len(contacts), paired(found, true) if len(found) == len(true) else math.nan


def paired(found: np.ndarray, true: np.ndarray) -> float:
    """Least mean distance of a one-to-one pairing of as many (k, 2) places; NaN for none."""
    if not len(found):
        return math.nan
    best = {0: 0.0}  # least sum so far, by the set of true places that are taken
    for distances in np.linalg.norm(found[:, None] - true[None], axis=2).tolist():
        sums: dict[int, float] = {}
        for taken, total in best.items():
            for number, distance in enumerate(distances):
                if not taken >> number & 1:
                    both = taken | 1 << number
                    sums[both] = min(sums.get(both, math.inf), total + distance)
        best = sums
    return min(best.values()) / len(found)


def scored(entry: Entry, there: Mapping[tuple[str, str], Truth]) -> Scores:
    scenes = {key: [judged(*one) for one in zip(entry.places[key], *truth)] for key, truth in there.items()}
    late = dict(entry.seconds)
    for model in MODELS:
        scenes["all", model] = [one for (_, by), found in scenes.items() if by == model for one in found]
    late["all"] = np.concatenate(list(late.values()))
    return {
        (family, model): Score(
            *(interval([float(one) for one in values]) for values in zip(*found)),
            *(quantile(late[family], part) for part in (0.5, 0.95)),
        )
        for (family, model), found in scenes.items()
    }


def worst(scores: Scores, model: str) -> str:
    """The family with the most wrong counts by a model."""
    families = [family for family, by in scores if by == model and family != "all"]
    return max(families, key=lambda family: scores[family, model].wrong.mean)


def wilson(hits: int, of: int, z: float = Z95) -> tuple[float, float]:
    """Wilson's interval of a share, by default of 95 %."""
    share, part = hits / of, z * z / of
    middle = (share + part / 2) / (1 + part)
    half = z * math.sqrt(share * (1 - share) / of + part / 4 / of) / (1 + part)
    return max(0.0, middle - half), min(1.0, middle + half)


def interval(values: Sequence[float]) -> Interval:
    """Interval of values without NaN: normal, or Wilson's for shares 0 or 1."""
    known = np.array([value for value in values if not math.isnan(value)], float)
    n = len(known)
    if not n:
        return Interval(math.nan, math.nan, math.nan, 0)
    mean = float(known.mean())
    if np.isin(known, (0.0, 1.0)).all():
        return Interval(mean, *wilson(int(known.sum()), n), n)
    half = Z95 * float(known.std(ddof=1)) / math.sqrt(n) if n > 1 else math.inf
    return Interval(mean, mean - half, mean + half, n)


def quantile(values: np.ndarray, part: float) -> Interval:
    """A quantile, infinite values included, with its interval by ranks; NaN if any value is unknown."""
    if np.isnan(values).any():
        return interval([])
    count, half = len(values), Z95 * math.sqrt(part * (1 - part) * len(values))
    ranks = np.ceil([part * count, part * count - half, part * count + half + 1]).astype(int) - 1
    ends = np.concatenate([[0.0], np.sort(values), [math.inf]])[np.clip(ranks + 1, 0, count + 1)]
    value, low, high = ends.tolist()
    return Interval(value, low, high, count)


def write(path: str | Path, found: Iterable[tuple[Entry, Scores]]) -> None:
    """Write scores as CSV: a line per entry, family and model, with the ends of each interval."""
    named = (name + end for name in Score._fields for end in ("", "_low", "_high"))
    lines: list[Sequence[object]] = [("entry", "kind", "pitch_mm", "family", "model", "scenes", *named)]
    for entry, scores in found:
        for key, one in scores.items():
            values = (end for interval in one for end in (interval.mean, interval.low, interval.high))
            lines.append((*entry[:3], *key, one.wrong.count, *(f"{value:.6g}" for value in values)))
    with open(path, "w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows(lines)


def shown(scores: Scores) -> Iterator[str]:
    """Two lines per model: of the worst family, and of all scenes."""
    for model in MODELS:
        for family in (worst(scores, model), "all"):
            one = scores[family, model]
            parts = ((100, "% wrong", one.wrong), (1, "mm off", one.place_mm), (1e3, "ms", one.median_s))
            told = (f"{by * at.mean:.2f} {unit} ({by * at.low:.2f} to {by * at.high:.2f})" for by, unit, at in parts)
            yield f"  {model}, {family}: {', '.join(told)}"


def main() -> int:
    parser = argparse.ArgumentParser(description="Score results on the benchmark's scenes.")
    parser.add_argument("scenes", help="Folder of the scenes, one NPZ file per family.")
    parser.add_argument("results", nargs="+", help="NPZ file of a method's results.")
    parser.add_argument("--csv", help="Also write the score of each family to this file.")
    given = parser.parse_args()
    try:
        found = [(entry, scored(entry, there)) for entry, there in (load(one, given.scenes) for one in given.results)]
        for entry, scores in found:
            print(f"{entry.name} ({entry.kind}, {entry.pitch_mm:g} mm)", *shown(scores), sep="\n")
        if given.csv:
            write(given.csv, found)
    except (ScoreError, OSError) as error:
        print(f"score.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
