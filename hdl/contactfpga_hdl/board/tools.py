"""Programs that make bitstreams of gateware."""

import shutil
import sysconfig


class BitstreamFailed(Exception):
    """No bitstream came out; the message says why."""


def tool(name: str) -> str:
    """Path of a program that comes with the extra ``boards``."""
    # Beside this Python first: an environment need not be on the PATH.
    found = shutil.which(name, path=sysconfig.get_path("scripts")) or shutil.which(name)
    if found is None:
        raise ModuleNotFoundError(f"no program {name}", name=name.replace("-", "_"))
    return found
