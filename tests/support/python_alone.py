"""What the tests of the commands share."""

import subprocess
import sys


def python(code, *arguments, timeout=60):
    command = [sys.executable, "-c", code, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=timeout)
