"""A converter of one's own: an MCP3204, which is an MCP3208 with four channels."""

import dataclasses

from contactfpga.choices.converters import CONVERTERS

MINE = dataclasses.replace(CONVERTERS["mcp3208"], name="toy_converter:MINE", title="MCP3204", channels=4)
