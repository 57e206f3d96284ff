"""Ctrl-C and TERM while a command starts: no traceback, no false reason, statuses 130 and 143."""

import os
import random
import signal
import subprocess
import sys
import time

import pytest
from sample import sample
from terminals import environment, listening

from contactfpga.tools.console import interrupt
from contactfpga.tools.console.signals import SIGNALS

STATUSES = {signal.SIGINT: 130, signal.SIGTERM: 143}
CUT_SHORT = {
    "settle": ["settle"],
    "cover": ["cover", "design", "--help"],
    "latency": ["latency", "--touches", "40"],
    "chart": ["study", "chart", "--placements", "200", "--no-size", "--output", "OUT"],
    "plot": ["plot", "nothing.mcap"],
    "doctor": ["doctor", "--list"],
}
"""Commands that a signal cuts short, or that end by themselves, also with an error, before one comes."""
RUNNING = {"zones": ["zones", "sim://", "--json"], "zones as a table": ["zones", "sim://"]}
"""Those whose usual end it is, once they run."""

linux = pytest.mark.skipif(sys.platform != "linux", reason="this system has no /proc")


def start(arguments, folder):
    words = [str(folder / "out") if one == "OUT" else one for one in arguments]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    command = [sys.executable, "-m", "contactfpga", *words]
    return subprocess.Popen(command, **pipes, text=True, preexec_fn=listening, env=environment(), cwd=folder)


def caught(process):
    """The numbers of the signals that a process handles."""
    with open(f"/proc/{process.pid}/status") as file:
        mask = next(int(line.split()[1], 16) for line in file if line.startswith("SigCgt"))
    return {number for number in range(1, 32) if mask >> number - 1 & 1}


def wait_until_it_listens(process):
    until = time.monotonic() + 60
    while process.poll() is None and signal.SIGTERM not in caught(process):
        assert time.monotonic() < until
        time.sleep(0.0005)


def assert_quiet(said):
    for word in ("Traceback", "KeyboardInterrupt", "Exception ignored", "Warning", "Error", "numpy", "failed"):
        assert word not in said, said


LOOKS = """
import importlib.abc, os, signal, sys
class Finder(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name == "numpy":
            print([signal.getsignal(one).__module__ for one in (signal.SIGINT, signal.SIGTERM)], flush=True)
            os._exit(0)
sys.meta_path.insert(0, Finder())
"""


def test_a_command_listens_before_it_loads_numpy(tmp_path):
    """Else there is half a second in which Ctrl-C ends with a traceback of numpy's."""
    (tmp_path / "sitecustomize.py").write_text(LOOKS)
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, "-m", "contactfpga", "zones", "sim://"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=250, env=environment(PYTHONPATH=path))
    assert (done.stdout, done.stderr) == (f"{[interrupt.__name__] * 2}\n", "")


@linux
@pytest.mark.parametrize("name", [*CUT_SHORT, *RUNNING])
@pytest.mark.parametrize("seed", sample(range(60), quick=range(1), slow=range(1, 8)))
def test_a_signal_at_any_moment_of_the_start(name, seed, tmp_path):
    rng = random.Random(f"{name} {seed}")
    number = rng.choice(SIGNALS)
    with start((CUT_SHORT | RUNNING)[name], tmp_path) as process:
        wait_until_it_listens(process)
        time.sleep(rng.choice([0.0, 0.1, 0.5, 1.5]) * rng.random())
        ended = process.poll() is not None
        process.send_signal(number)
        _, errors = process.communicate(timeout=100)
    if ended:
        return
    assert_quiet(errors)
    at_their_end = {0, 1, 2} if name in ("doctor", "plot", "cover") else {0}  # it may end just before the signal
    at_their_end |= {-number}  # Python takes its handlers away before it ends; a shell shows the same status
    assert process.returncode in {STATUSES[number]} | at_their_end, errors


CUTS_OFF = """
import importlib.abc, importlib.machinery, os, sys
class Finder(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name != "LIBRARY":
            return None
        spec = importlib.machinery.PathFinder.find_spec(name, path)
        spec.loader.exec_module = lambda module: [os.kill(os.getpid(), NUMBER), *range(100)]
        return spec
sys.meta_path.insert(0, Finder())
"""


@pytest.mark.parametrize("number", SIGNALS)
@pytest.mark.parametrize("library", ["matplotlib.ft2font", "matplotlib._path"])
def test_a_signal_while_a_library_of_c_plus_plus_loads(library, number, tmp_path):
    """At the end of Python, ft2font's destructors would abort the process."""
    (tmp_path / "sitecustomize.py").write_text(CUTS_OFF.replace("LIBRARY", library).replace("NUMBER", str(int(number))))
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, "-m", "contactfpga", "plot", "nothing.mcap"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=250, env=environment(PYTHONPATH=path))
    assert (done.returncode, done.stderr) == (STATUSES[number], "")


STARTS = """
from contactfpga.tools.console import interrupt, signals
WORK
signals.end_all_at_once()
interrupt.leave(interrupt.guarded(body))
"""
BROKEN = {
    "dropped": """
import os, signal, time
class Dropped:
    def __del__(self):
        os.kill(os.getpid(), NUMBER)
        for _ in range(100): pass
def body():
    Dropped()
    time.sleep(200)
""",
    "made something else": """
import os
def body():
    try:
        os.kill(os.getpid(), NUMBER)
        for _ in range(100): pass
    except BaseException:
        raise ImportError("numpy is badly installed") from None
""",
    "made an error of ours": """
import os
from contactfpga.errors import PortNotFound
def body():
    try:
        os.kill(os.getpid(), NUMBER)
        for _ in range(100): pass
    except BaseException:
        raise PortNotFound("no such port") from None
""",
    "nothing": """
import os
def body():
    try:
        os.kill(os.getpid(), NUMBER)
        for _ in range(100): pass
    except BaseException:
        pass
""",
    "twice": """
import os
def body():
    try:
        os.kill(os.getpid(), NUMBER)
        for _ in range(100): pass
    finally:
        os.kill(os.getpid(), NUMBER)
        for _ in range(100): pass
""",
}
"""What becomes of a signal in other people's code."""


@pytest.mark.parametrize("number", SIGNALS)
@pytest.mark.parametrize("how", BROKEN)
def test_a_signal_that_others_make_something_of(how, number):
    program = STARTS.replace("WORK", BROKEN[how]).replace("NUMBER", str(int(number)))
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=250, env=environment()
    )
    assert (done.returncode, done.stderr) == (STATUSES[number], "")


TEXT = "exec('import os; os.kill(os.getpid(), NUMBER); [0 for _ in range(100)]')"
"""A signal while Python runs a text, as it does to make a dataclass; `python -m` then ended by SIGINT."""
IN_A_TEXT = {
    "raised": f"""
def body():
    {TEXT}
""",
    "dropped": f"""
def body():
    try:
        {TEXT}
    except BaseException:
        return 0
""",
    "usual end": f"""
def body():
    with interrupt.usual_end():
        {TEXT}
""",
}


@pytest.mark.parametrize("number", SIGNALS)
@pytest.mark.parametrize("how", IN_A_TEXT)
def test_a_signal_while_python_runs_a_text(how, number, tmp_path):
    program = STARTS.replace("WORK", IN_A_TEXT[how]).replace("NUMBER", str(int(number)))
    (tmp_path / "started.py").write_text(program)
    done = subprocess.run(
        [sys.executable, "-m", "started"],
        capture_output=True,
        text=True,
        timeout=250,
        env=environment(PYTHONPATH=os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])),
    )
    assert (done.returncode, done.stderr) == (0 if how == "usual end" else STATUSES[number], "")


def test_what_fails_after_the_usual_end_is_told(capsys):
    def body():
        with interrupt.usual_end():
            os.kill(os.getpid(), signal.SIGINT)
            pytest.fail("it did not end")
        raise OSError(28, "No space left on device", "x.mcap")

    assert interrupt.guarded(body) == 1
    assert capsys.readouterr().err == "contactfpga: x.mcap: No space left on device\n"


def test_other_errors_are_raised():
    def body():
        raise RuntimeError("a mistake of ours")

    with pytest.raises(RuntimeError, match="a mistake of ours"):
        interrupt.guarded(body)
