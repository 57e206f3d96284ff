"""Two links of a body whose sheets are at one FPGA."""

import contactfpga
from contactfpga.body import Body

SHEETS = contactfpga.examples() / "two-sheets.toml"
LINK = """
[[links]]
name = "{name}"
frame = "{name}"
skin = "{folder}/two-sheets-{name}.toml"
port = "sim://?scene=palm&sheets={folder}/two-sheets.toml#{number}"
late_s = 60.0
silent_s = 90.0
"""


def test_two_links_share_a_port(tmp_path):
    links = [
        LINK.format(name=name, number=number, folder=SHEETS.parent) for number, name in enumerate(("chest", "back"))
    ]
    (tmp_path / "robot.toml").write_text("".join(links))
    with Body.load(tmp_path / "robot.toml").open() as body:
        snapshot = body.read(timeout=60.0)
    found = {name: (link.status, len(link.zones)) for name, link in snapshot.links.items()}
    assert found == {"chest": ("ok", 1), "back": ("ok", 1)}
