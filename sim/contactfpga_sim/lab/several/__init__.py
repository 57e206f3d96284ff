"""Cost of several sheets at one FPGA."""
