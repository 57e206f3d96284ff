"""What is known of a rival, and whether a folder holds the very sources that are stated."""

from __future__ import annotations

import dataclasses
import hashlib
import subprocess
from collections.abc import Callable
from pathlib import Path

from rivals.house import ContactFPGAError, square


class RivalError(ContactFPGAError):
    """A rival cannot be measured; the message says what is missing or wrong."""


@dataclasses.dataclass(frozen=True)
class Sheet:
    """A square sheet as a rival is given it, and the widths of a record; the port's names for them."""

    size: int
    blank_columns: int
    blank_rows: int

    @property
    def width(self) -> int:
        return self.size + self.blank_columns

    @property
    def period(self) -> int:
        """Clocks from frame to frame."""
        return self.width * (self.size + self.blank_rows)

    @property
    def place_bits(self) -> int:
        """Of x, and of y."""
        return (self.size - 1).bit_length()

    @property
    def moment_bits(self) -> tuple[int, int, int]:
        """Of area, sum x and sum y: those that our records have."""
        derived = square(self.size).derived
        return derived.area_bits, derived.sum_x_bits, derived.sum_y_bits


@dataclasses.dataclass(frozen=True)
class Rival:
    """A labeller of other people, as a Verilog module ``top``.

    A cell arrives in every clock, no record can wait, and all records of a frame leave before the next frame's first
    row is complete. Ports on an N x N sheet:

    - ``clk``, ``rst``: ``rst`` is 1 for more than two rows before the first frame.
    - ``pressed``: the cell of this clock, row by row from the top, each from column 0; the blank cells and rows that
      the labeller needs follow each row and frame.
    - ``x``, ``y``: coordinates of the cell, enough bits for N - 1; meaningless for blank cells.
    - ``found``: a record is there in this clock.
    - ``zone``: area in the lowest bits, then sum x, then sum y, as wide as in our records.
    """

    name: str
    blank_columns: int
    """Cells after each row, and rows after each frame, that it needs blank."""
    blank_rows: int
    convert: Callable[[Path, Sheet, bool], str]
    """From a clone: Verilog with this module. If the flag is set its memories give wrong words
    where one is read while it is written, to show whether it uses such words."""
    url: str = ""
    """Empty: ``convert`` needs no clone."""
    commit: str = ""
    sources: tuple[str, ...] = ()
    """Files of the clone that are converted."""
    converter: Callable[[], str] = lambda: "none"
    """Name and version of the program that ``convert`` runs."""

    def sheet(self, size: int) -> Sheet:
        return Sheet(size, self.blank_columns, self.blank_rows)

    def digest(self, clone: Path) -> str:
        """SHA-256 of the sources, one after the other."""
        return hashlib.sha256(b"".join((clone / name).read_bytes() for name in self.sources)).hexdigest()

    def check(self, clone: Path) -> None:
        """Raise :class:`RivalError` unless the folder is a clone at the commit, with nothing changed."""
        if not self.url:
            return
        if not (clone / ".git").exists():
            raise RivalError(f"{clone} is not a clone of {self.name}; make one with: git clone {self.url} {clone}")
        found = git("-C", str(clone), "rev-parse", "HEAD")
        if found != self.commit:
            raise RivalError(
                f"{clone} is at commit {found[:7]}; {self.name} is measured at {self.commit[:7]}; switch with: "
                f"git -C {clone} checkout {self.commit}"
            )
        if changed := git("-C", str(clone), "status", "--porcelain", "--untracked-files=no"):
            raise RivalError(
                f"{clone} has local changes ({changed.splitlines()[0].split()[-1]}); undo them with: "
                f"git -C {clone} checkout -- ."
            )

    def fetch(self, clone: Path) -> None:
        """Make a clone at the commit, if there is anything to clone."""
        if self.url and not (clone / ".git").exists():
            git("clone", "--quiet", "--no-checkout", self.url, str(clone))
            git("-C", str(clone), "checkout", "--quiet", self.commit)


def git(*arguments: str) -> str:
    """What git prints; raises :class:`RivalError` where it is absent or fails."""
    try:
        done = subprocess.run(["git", *arguments], capture_output=True, text=True, stdin=subprocess.DEVNULL)
    except FileNotFoundError:
        raise RivalError("git, which fetches and checks the sources, was not found; sudo apt install git") from None
    if done.returncode:
        said = (done.stderr.strip().splitlines() or ["it says nothing"])[-1]
        raise RivalError(f"git {' '.join(arguments)} failed: {said}; --clone FOLDER takes a clone made elsewhere")
    return done.stdout.strip()
