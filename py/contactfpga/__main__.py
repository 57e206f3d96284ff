"""``python -m contactfpga``: the command `contactfpga`, also where its folder is not on the PATH."""

import sys

from contactfpga.cli import main

if __name__ == "__main__":
    sys.exit(main())
