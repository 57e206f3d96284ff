"""The supported boards; a new one is a file here and an entry in :data:`BOARDS`."""

from contactfpga.boards.ice40 import ICEBREAKER, ICESTICK
from contactfpga.boards.spec import BoardSpec
from contactfpga.boards.ulx3s import ULX3S_12F, ULX3S_12F_FT232H, ULX3S_85F
from contactfpga.choices.choice import load_own
from contactfpga.inputs.values import suggestion
from contactfpga.skin import SkinError

__all__ = ["BOARDS", "find"]

BOARDS: dict[str, BoardSpec] = {
    board.name: board for board in (ICEBREAKER, ICESTICK, ULX3S_12F, ULX3S_85F, ULX3S_12F_FT232H)
}


def find(name: str) -> BoardSpec:
    """The board of that name, or at a user's ``module:attribute``. Raises SkinError that lists the names."""
    if name in BOARDS:
        return BOARDS[name]
    if ":" not in name:
        known = [*BOARDS, "module:attribute of your own"]
        raise SkinError(f"no board is called {name!r}; {suggestion(name, known)}")
    board = load_own(name, f"the board {name!r}")
    if not isinstance(board, BoardSpec):
        raise SkinError(f"{name!r} is a {type(board).__name__}; it must be a BoardSpec")
    return board
