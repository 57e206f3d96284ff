"""No command can be reached from another computer unless that was asked for."""

import json
import sys

import pytest
from fake_board import FakeBoard, wait_until
from net_processes import Child, free_endpoint

import contactfpga

SKIN = contactfpga.Skin(name="left")

PROGRAM = """
import contextlib, ipaddress, json, os, socket, stat, sys, threading, time
from contactfpga.tools import cli

def run(arguments):
    while cli.main(arguments):  # for instance as nobody publishes yet
        time.sleep(0.1)

def inet_sockets():
    for number in os.listdir("/proc/self/fd"):
        with contextlib.suppress(OSError):  # closed meanwhile
            if stat.S_ISSOCK(os.fstat(int(number)).st_mode):
                with socket.socket(fileno=os.dup(int(number))) as one:
                    if one.family in (socket.AF_INET, socket.AF_INET6):
                        yield one

def look():
    found = []
    for one in inet_sockets():
        ip, port, *_ = one.getsockname()
        inside = ipaddress.ip_address(ip).is_loopback
        inside |= one.getsockopt(socket.SOL_SOCKET, socket.SO_BINDTODEVICE, 16).rstrip(bytes(1)) == b"lo"
        listens = bool(one.getsockopt(socket.SOL_SOCKET, socket.SO_ACCEPTCONN))
        found.append([one.type == socket.SOCK_DGRAM, ip, port, inside, listens])
    return found

for arguments in json.loads(sys.argv[1]):
    threading.Thread(target=run, args=(arguments,), daemon=True).start()
while True:
    print("sockets", json.dumps(look()), file=sys.stderr, flush=True)
    time.sleep(0.3)
"""


def sockets(child, enough):
    """What the program shows once that is enough: (whether of UDP, address, port, whether inside, whether listening)"""
    said = []
    for line in child.process.stderr:
        said.append(line)
        if line.startswith("sockets ") and enough(found := json.loads(line[8:])):
            return found
    raise AssertionError("it ended: " + "".join(said[-20:]))


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="looks into /proc")
def test_no_command_listens_but_on_this_computer(tmp_path):
    """All commands that run on, in one program: zones over the network, publish, record, body, view and ros."""
    for package in ("zenoh", "viser", "cyclonedds"):
        pytest.importorskip(package)
    endpoint = free_endpoint()
    (tmp_path / "skin.toml").write_text(SKIN.to_toml())
    names = ("publish", "connect", "record", "body", "view", "ros")
    boards = {name: FakeBoard(SKIN) for name in names}
    body = '[[links]]\nname = "left"\nskin = "skin.toml"\nport = "{}"\n'
    (tmp_path / "robot.toml").write_text(body.format(boards["body"].path))
    commands = [
        ["publish", boards["publish"].path, "--listen", endpoint],
        ["publish", boards["connect"].path, "--connect", endpoint, "--key", "other"],
        ["zones", f"zenoh://contactfpga/left?connect={endpoint}", "--json"],
        ["record", str(tmp_path / "x.mcap"), boards["record"].path],
        ["body", str(tmp_path / "robot.toml"), "--seconds", "600"],
        ["view", boards["view"].path, "--no-browser", "--http-port", "0"],
        ["ros", boards["ros"].path, "--domain", "88"],
    ]
    with Child("-c", PROGRAM, json.dumps(commands), wait=False) as child:
        found = sockets(child, lambda now: len([one for one in now if one[4]]) >= 2 and any(one[0] for one in now))
        wait_until(lambda: all(board.asked for board in boards.values()))
        found = sockets(child, lambda now: True)
    for board in boards.values():
        board.close()
    assert [one for one in found if not one[3]] == []
