"""The parser of the command line."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any, NoReturn

from contactfpga.inputs.values import shortened, visible_lines


class Parser(argparse.ArgumentParser):
    """Takes options anywhere. By itself argparse refuses a word after an option where it could have been left out, as
    the port in `contactfpga record FILE --seconds 2 PORT`.

    ``add``: adds the arguments to the parser, once the parser is used. So what they need is not loaded for a parser
    that is only listed.
    """

    _within = False

    usual_topic: str | None = None
    """Topic of a command whose first word names none."""

    def __init__(self, *args: Any, add: Callable[[Parser], None] | None = None, **options: Any):
        super().__init__(*args, **options)
        self._add = add

    def complete(self) -> None:
        """Add the arguments, if that has not been done yet."""
        add, self._add = self._add, None
        if add is not None:
            add(self)

    @property
    def topics(self) -> dict[str, Parser]:
        """The parsers of commands or topics below this one, by name."""
        self.complete()
        actions = [action for action in self._actions if isinstance(action, argparse._SubParsersAction)]
        return {name: parser for action in actions for name, parser in action.choices.items()}

    def error(self, message: str) -> NoReturn:
        """End with argparse's message, in which control characters of the arguments are shown as escapes."""
        super().error(visible_lines(shortened(message)))

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """As argparse does, but with options anywhere."""
        topics = self.topics
        if self.usual_topic is not None and args and args[0] not in ("-h", "--help", *topics):
            args = [self.usual_topic, *args]
        if self._within or topics:
            return super().parse_known_args(args, namespace)
        self._within = True  # what comes next calls this method, for the options and then for the rest
        try:
            return self.parse_known_intermixed_args(args, namespace)
        finally:
            self._within = False
