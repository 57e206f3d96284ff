"""How the C header is compiled."""

import subprocess
from pathlib import Path

FOLDER = Path(__file__).parents[2] / "c"
WARNINGS = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror", "-O1"]
SANITIZED = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
COMPILERS = {
    "gcc": ["gcc", "-std=c99", *WARNINGS, *SANITIZED],
    "gcc with the table": ["gcc", "-std=c99", "-DCONTACTFPGA_FAST", *WARNINGS, *SANITIZED],
    "clang": ["clang", "-std=c99", *WARNINGS],
    "g++": ["g++", "-x", "c++", "-std=c++11", *WARNINGS],
    "clang++": ["clang++", "-x", "c++", "-std=c++11", *WARNINGS],
}


def program(folder: Path, code: str) -> Path:
    """A program of this code, which may include the header."""
    (folder / "program.c").write_text(code)
    command = [*COMPILERS["gcc"], f"-I{FOLDER}", "-o", folder / "program", folder / "program.c"]
    subprocess.run(command, check=True, timeout=250)
    return folder / "program"


def answers(of: Path, asked: str) -> list[str]:
    """Lines that a program writes to these."""
    done = subprocess.run([of], input=asked, capture_output=True, text=True, check=True, timeout=250)
    return done.stdout.splitlines()
