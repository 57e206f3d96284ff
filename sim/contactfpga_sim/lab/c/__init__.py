"""Memory and code of the C header on microcontrollers."""
