"""Processes that a test has started, as the kernel tells of them."""

import os
from pathlib import Path


def children(parent=None):
    """(id, words of the command) of all children of a process that run."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            status = (folder / "stat").read_text().rpartition(")")[2].split()
            words = (folder / "cmdline").read_bytes().split(b"\0")
        except OSError:
            continue
        if int(status[1]) == (parent or os.getpid()) and status[0] != "Z":
            found.append((int(folder.name), [word.decode() for word in words]))
    return found


def reader_processes(port, parent=None):
    """Those that read this port for the process."""
    return [number for number, words in children(parent) if f"reader of {port}" in words]


def alive(number):
    """Whether there is such a process, and it has not ended."""
    try:
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
