"""The entry point of the command `contactfpga`, also as ``python -m contactfpga``."""

import sys

from contactfpga.tools.console import signals


def main() -> int:
    """Run the command; a signal ends it quietly also while it is still being loaded."""
    signals.end_all_at_once()
    from contactfpga.tools import cli

    return cli.main()


if __name__ == "__main__":
    sys.exit(main())
