"""Processes that a test has started, as the kernel tells of them."""

import os
from pathlib import Path


def running():
    """{id: (id of its parent, words of its command)} of all processes that run."""
    found = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            status = (folder / "stat").read_text().rpartition(")")[2].split()
            words = (folder / "cmdline").read_bytes().split(b"\0")
        except OSError:
            continue
        if status[0] != "Z":
            found[int(folder.name)] = int(status[1]), [word.decode(errors="replace") for word in words]
    return found


def children(parent=None):
    """(id, words of the command) of all children of a process that run."""
    parent = parent or os.getpid()
    return [(number, words) for number, (above, words) in running().items() if above == parent]


def descendants(number):
    """Every process below this one: {id: command line}."""
    every, below = running(), {number}
    while new := {child for child, (above, _) in every.items() if above in below} - below:
        below |= new
    return {child: " ".join(every[child][1]) for child in below - {number}}


def alive(number):
    """Whether there is such a process, and it has not ended."""
    try:
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
