"""The commands of `contactfpga`, one file each; loaded when called."""
