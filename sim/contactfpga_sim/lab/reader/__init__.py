"""How soon frames reach user code, with either reader, beside a C program on the same line."""
