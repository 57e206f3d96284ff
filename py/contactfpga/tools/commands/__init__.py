"""The commands of `contactfpga`, one file or folder each; loaded on call."""
