"""Cost of several sheets on one FPGA."""
