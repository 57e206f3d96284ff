"""Common code of commands: terminal, interrupts, numbers on the command line, tables, places for output."""
