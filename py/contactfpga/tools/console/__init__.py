"""What commands share: terminal, interrupts, numbers on the command line, tables, places for output."""
