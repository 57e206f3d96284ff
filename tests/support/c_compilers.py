"""How the C header is compiled."""

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
