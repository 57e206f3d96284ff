"""Programs that make bitstreams."""

import shutil
import sysconfig


class BitstreamFailed(Exception):
    """No bitstream was made; the message gives the reason."""


def tool(name: str) -> str:
    """Path of a program of the extra ``boards``. Raises ModuleNotFoundError."""
    # Beside this Python first: an environment need not be on the PATH.
    found = shutil.which(name, path=sysconfig.get_path("scripts")) or shutil.which(name)
    if found is None:
        raise ModuleNotFoundError(f"no program {name}", name=name.replace("-", "_"))
    return found
