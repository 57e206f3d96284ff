"""The parser of the command line."""

from __future__ import annotations

import argparse
from typing import Any, NoReturn

from contactfpga.inputs.values import shortened, visible_lines


class Parser(argparse.ArgumentParser):
    """Takes options anywhere. By itself argparse refuses a word after an option where it could have been left out, as
    the port in `contactfpga record FILE --seconds 2 PORT`."""

    _within = False

    def error(self, message: str) -> NoReturn:
        """End with argparse's message, in which control characters of the arguments are shown as escapes."""
        super().error(visible_lines(shortened(message)))

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """As argparse does, but with options anywhere."""
        topics = any(action.nargs == argparse.PARSER for action in self._get_positional_actions())
        if self._within or topics:
            return super().parse_known_args(args, namespace)
        self._within = True  # what comes next calls this method, for the options and then for the rest
        try:
            return self.parse_known_intermixed_args(args, namespace)
        finally:
            self._within = False
