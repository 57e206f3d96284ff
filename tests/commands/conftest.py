"""What the tests of the commands share."""

import pytest

from contactfpga.tools import cli


@pytest.fixture
def run(capsys):
    """Runs a command in this process; returns status, output and errors."""

    def run(*arguments):
        status = cli.main([str(argument) for argument in arguments])
        return status, *capsys.readouterr()

    return run
