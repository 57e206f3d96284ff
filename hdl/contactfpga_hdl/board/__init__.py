"""From a Skin to a bitstream on a board (contactfpga.boards)."""
