"""The command `contactfpga`, also as ``python -m contactfpga``."""

from typing import NoReturn

from contactfpga.tools.console import signals


def main() -> NoReturn:
    """Run the command. A signal ends it quietly even while it is being loaded."""
    signals.end_all_at_once()
    from contactfpga.tools import cli
    from contactfpga.tools.console import interrupt

    interrupt.leave(cli.main())


if __name__ == "__main__":
    main()
