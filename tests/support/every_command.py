"""Every command and topic of the table, with what each is called by.

A test that runs over these needs no line for a new command whose arguments have the names of others."""

from contactfpga.tools import cli

ARGUMENTS = {
    "robot": "robot.toml",
    "board": "icebreaker",
    "frames": "frames.npy",
    "recording": "frames.npy",
    "file": "out.mcap",
    "mesh": "mesh.stl",
    "output": "table.npz",
    "scenes": "fingers",
    "skin": "tiles.toml",
    "link": "arm",
    "points": "points.toml",
    "joint": "joint",
    "table": "out.csv",
}
"""Values of the arguments that commands ask for; others are empty."""
OPTIONS = {("haptics", "threshold"): ["--unit", "0=5"]}
"""Options without which a command does nothing."""


def leaves():
    """The parser of each command without topics, and of each topic."""
    return list(cli.leaves(cli._parser()))


def positional(leaf):
    """Its arguments that are no options."""
    return [action for action in leaf._actions if not action.option_strings]


def options(leaf):
    """Its options, by what is typed."""
    return {option: action for action in leaf._actions for option in action.option_strings}


def called(leaf):
    """The words that call it, with values of what it asks for."""
    words = leaf.prog.split()[1:]
    needed = [ARGUMENTS.get(action.dest, "") for action in positional(leaf) if action.nargs not in ("?", "*")]
    return [*words, *OPTIONS.get(tuple(words), []), *needed]
