"""Runs tests against a copy of the gateware in which a fault is planted."""

import contextlib
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
GATEWARE = Path("contactfpga_hdl")

PASSED, FAILED = 0, 1


@contextlib.contextmanager
def planted(changed: Mapping[str, str]) -> Iterator[Path]:
    """A source root with a copy of the gateware in which these files, named from ``contactfpga_hdl`` on, have these
    texts."""
    with tempfile.TemporaryDirectory(prefix="contactfpga-planted-") as folder:
        root = Path(folder)
        shutil.copytree(ROOT / "hdl" / GATEWARE, root / GATEWARE, ignore=shutil.ignore_patterns("__pycache__"))
        for file, text in changed.items():
            (root / GATEWARE / file).write_text(text)
        yield root


def replaced(file: str, old: str, new: str) -> str:
    """The text of a file of the gateware with ``old`` replaced. Raises ValueError unless that is there exactly once."""
    text = (ROOT / "hdl" / GATEWARE / file).read_text()
    if (count := text.count(old)) != 1:
        raise ValueError(f"{file} has {count} times, not once: {old}")
    return text.replace(old, new)


def environment(root: Path) -> dict[str, str]:
    """In which Python takes the gateware from this source root. Compiled boards go into a cache beside it."""
    folders = [str(root), str(ROOT / "py"), str(ROOT / "sim")]
    return {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(folders),
        "PYTHONDONTWRITEBYTECODE": "1",
        "CONTACTFPGA_CACHE": str(root / "cache"),
    }


def notice(root: Path, tests: Sequence[str], seconds: float) -> tuple[bool, str]:
    """Whether tests that belong to ``make test`` fail with the gateware of this source root, and what they say.

    They notice as well if the gateware cannot be imported or if they take longer than ``seconds``. Raises RuntimeError
    if there are no such tests.
    """
    options = ["--quick", "-q", "-x", "-n", "0", "-p", "no:cacheprovider", "--tb=line", "--timeout", "600"]
    command = [sys.executable, "-m", "pytest", *options, *tests]
    try:
        result = subprocess.run(
            command,
            cwd=ROOT,
            env=environment(root),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=seconds,
        )
    except subprocess.TimeoutExpired:
        return True, f"no end after {seconds:.0f} s"
    if result.returncode not in (PASSED, FAILED) and "ERROR collecting" not in result.stdout:
        raise RuntimeError(f"pytest ended with status {result.returncode}:\n{result.stdout[-2000:]}")
    return result.returncode != PASSED, result.stdout
