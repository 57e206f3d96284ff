"""Installs what `make` asks for with pip: one line says how far it is, and pip's own words go to a file.

    python scripts/install.py LOG ARGUMENT...     the arguments are those of `pip install`

Where pip fails the last lines of the file are shown, and where it lies.
"""

import subprocess
import sys
import time
from pathlib import Path

SHOWN = 12
"""Last lines of pip's words where it fails."""

EVERY_S = 0.5
"""How often the line is written over."""


def main(log: str, *arguments: str) -> int:
    """Run pip; returns its status."""
    command = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "--disable-pip-version-check",
        "--progress-bar",
        "off",
        *arguments,
    ]
    with open(log, "wb") as file, subprocess.Popen(command, stdout=file, stderr=subprocess.STDOUT) as pip:
        try:
            follow(pip, Path(log))
        except KeyboardInterrupt:  # pip gets it, too
            return 130
    if pip.returncode:
        last = said(Path(log))[-SHOWN:]
        print("\n".join([*last, f">>> pip failed; all of its words are in {log}"]), file=sys.stderr)
    return pip.returncode


def follow(pip: subprocess.Popen, log: Path) -> None:
    """Wait for the end of pip; on a terminal with a line that says how far it is."""
    began_s, live = time.monotonic(), sys.stdout.isatty()
    while live and pip.poll() is None:
        words = said(log)
        packages = sum(line.startswith(("Collecting ", "Processing ")) for line in words)
        unpacks = any(line.startswith("Installing collected packages") for line in words)
        doing = "unpacking" if unpacks else "fetching"
        print(f"\r    {doing}, {packages} packages, {time.monotonic() - began_s:.0f} s\033[K", end="", flush=True)
        time.sleep(EVERY_S)
    pip.wait()
    if live:
        print("\r\033[K", end="", flush=True)


def said(log: Path) -> list[str]:
    """Lines that pip has written so far."""
    return log.read_text(encoding="utf-8", errors="replace").splitlines()


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
