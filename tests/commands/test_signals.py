"""Ctrl-C and TERM: no traceback, no false reason, statuses 130 and 143, whatever other people's code makes of them."""

import os
import signal
import subprocess
import sys
import time

import pytest
from terminals import environment

import contactfpga
from contactfpga.tools import cli
from contactfpga.tools.console import interrupt
from contactfpga.tools.console.signals import SIGNALS

STATUSES = {signal.SIGINT: 130, signal.SIGTERM: 143}


def done(*words, path=""):
    """A process of Python that ended, which finds modules in this folder."""
    found = os.pathsep.join([str(path), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=250, env=environment(PYTHONPATH=found))


# ---- while a command starts


FINDS = """
import importlib.abc, importlib.machinery, os, signal, sys
class Finder(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name != "LIBRARY":
            return None
        spec = importlib.machinery.PathFinder.find_spec(name, path)
        spec.loader.exec_module = load
        return spec
def load(module):
    DO
sys.meta_path.insert(0, Finder())
"""
"""What is done in place of loading a library, in a process that finds this as `sitecustomize`."""


def test_a_command_listens_before_it_loads_numpy(tmp_path):
    """Else there is half a second in which Ctrl-C ends with a traceback of numpy's."""
    look = "print(*(signal.getsignal(one).__module__ for one in (2, 15)), flush=True); os._exit(0)"
    (tmp_path / "sitecustomize.py").write_text(FINDS.replace("LIBRARY", "numpy").replace("DO", look))
    found = done("-m", "contactfpga", "zones", "sim://", path=tmp_path)
    assert (found.stdout, found.stderr) == (f"{interrupt.__name__} {interrupt.__name__}\n", "")


@pytest.mark.parametrize("number", SIGNALS)
@pytest.mark.parametrize("library", ["matplotlib.ft2font", "matplotlib._path"])
def test_a_signal_while_a_library_of_c_plus_plus_loads(library, number, tmp_path):
    """At the end of Python, ft2font's destructors would abort the process."""
    end = f"os.kill(os.getpid(), {int(number)}); [*range(100)]"
    (tmp_path / "sitecustomize.py").write_text(FINDS.replace("LIBRARY", library).replace("DO", end))
    found = done("-m", "contactfpga", "plot", "nothing.mcap", path=tmp_path)
    assert (found.returncode, found.stderr) == (STATUSES[number], "")


# ---- what becomes of a signal


STARTS = """
import os, time
from contactfpga.errors import PortNotFound
from contactfpga.tools.console import interrupt, signals

def end():
    os.kill(os.getpid(), NUMBER)
    for _ in range(100): pass

class Dropped:
    def __del__(self):
        end()

def body():
    BODY

signals.end_all_at_once()
interrupt.leave(interrupt.guarded(body))
"""
BODIES = {
    "dropped by a destructor": "Dropped(); time.sleep(200)",
    "made something else": """try: end()
    except BaseException: raise ImportError("numpy is badly installed") from None""",
    "made an error of ours": """try: end()
    except BaseException: raise PortNotFound("no such port") from None""",
    "dropped": """try: end()
    except BaseException: pass""",
    "twice": """try: end()
    finally: end()""",
    # `python -m` would end by SIGINT after a signal in a text, such as Python runs to make a dataclass.
    "in a text": "exec('end(); 1')",
    "in a text, dropped": """try: exec('end(); 1')
    except BaseException: return 0""",
    "in a text, usual end": """with interrupt.usual_end(): exec('end(); 1')""",
}
"""Ways in which the code of a command may treat a signal."""


@pytest.mark.parametrize("number", SIGNALS)
@pytest.mark.parametrize("how", BODIES)
def test_a_signal_that_others_make_something_of(how, number, tmp_path):
    (tmp_path / "started.py").write_text(STARTS.replace("BODY", BODIES[how]).replace("NUMBER", str(int(number))))
    found = done("-m", "started", path=tmp_path)
    assert (found.returncode, found.stderr) == (0 if "usual end" in how else STATUSES[number], "")


def test_a_signal_is_not_repeated_while_the_command_cleans_up():
    def body():
        try:
            signal.raise_signal(signal.SIGINT)
        finally:
            time.sleep(10 * interrupt.AGAIN_S)
            cleaned.append(True)

    cleaned = []
    assert (interrupt.guarded(body), cleaned) == (130, [True])


@pytest.mark.parametrize("moment", range(2 * len(SIGNALS)))
def test_a_signal_while_listening_begins_or_ends_is_no_traceback(moment, monkeypatch):
    """One comes right after each change of a handler, to ours and back to what it was."""
    changed, right = [], signal.signal

    def change(number, handler):
        before = right(number, handler)
        changed.append(number)
        if len(changed) == moment + 1 and signal.getsignal(signal.SIGINT) is interrupt._interrupt:
            signal.raise_signal(signal.SIGINT)
        return before

    monkeypatch.setattr(signal, "signal", change)
    try:
        status = interrupt.guarded(lambda: 0)
    finally:
        monkeypatch.undo()
        for number in SIGNALS:
            signal.signal(number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)
    assert status in (0, 130)
    assert moment or status == 130


# ---- after the usual end


@pytest.mark.parametrize("number", SIGNALS)
def test_what_fails_after_the_usual_end_is_reported(number, capsys):
    """Signals are handled as before once a command is done."""
    before = [signal.getsignal(one) for one in SIGNALS]

    def body():
        with interrupt.usual_end():
            os.kill(os.getpid(), number)
            pytest.fail("it did not end")
        raise OSError(28, "No space left on device", "x.mcap")

    assert interrupt.guarded(body) == 1
    assert capsys.readouterr().err == "contactfpga: x.mcap: No space left on device\n"
    assert [signal.getsignal(one) for one in SIGNALS] == before


def test_what_is_asked_to_do_one_thing_is_cut_short(board, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(contactfpga.Board, "next", interrupted)
    assert cli.main(["zones", "--once", board.path]) == 130


def test_other_errors_are_raised():
    def body():
        raise RuntimeError("a mistake of ours")

    with pytest.raises(RuntimeError, match="a mistake of ours"):
        interrupt.guarded(body)
