"""One parameter per study, moved until a method fails on the compiled gateware."""
