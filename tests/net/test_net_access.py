"""Who may read a published board and who may not: each refusal is one sentence, or counted."""

import re
import shutil
import subprocess
import time
from pathlib import Path

import pytest
from fake_board import FakeBoard, patiently, wait_until
from net_processes import Streaming, assert_loopback_alone, free_endpoint, patient, publish
from small_port import SmallPort, published

import contactfpga
from contactfpga.robot.net import port as net_port
from contactfpga.robot.net import session
from contactfpga.robot.net.message import MOST_ASKED, Message
from contactfpga.tools import cli
from contactfpga.wire.command import Command, encode_command

psutil = pytest.importorskip("psutil")
pytest.importorskip("zenoh")
pytestmark = pytest.mark.usefixtures("_closed_ports")

SKIN = contactfpga.Skin(name="left forearm")
LONG = 60.0

PAGE = (Path(__file__).parents[2] / "docs" / "net.md").read_text(encoding="utf-8")
AUTHORITY, CERTIFICATE = re.findall(r"^    (openssl .*)$", PAGE, re.MULTILINE)
NAMES = "-addext basicConstraints=CA:FALSE -addext subjectAltName=DNS:localhost,IP:127.0.0.1"
ASKED = (
    f"openssl req -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -subj /CN=localhost {NAMES} "
    "-keyout old-key.pem -out old.csr"
)
EXPIRED = (
    "openssl x509 -req -in old.csr -CA authority.pem -CAkey authority-key.pem -CAcreateserial -copy_extensions copy "
    "-days -1 -out old.pem"
)


class Keys:
    """A folder with certificates, made as docs/net.md says, and the files of examples/net."""

    def __init__(self, folder):
        self.folder, self.endpoint = folder, free_endpoint("tls")
        self._count = 0
        self.make(AUTHORITY, CERTIFICATE)
        (folder / "users.txt").write_text("robot:a long password\nvisitor:a ticket\n")

    def make(self, *commands):
        for command in commands:
            subprocess.run(command.split(), cwd=self.folder, check=True, capture_output=True, timeout=250)

    def config(self, name, *changes, endpoint=None):
        """A file of the example, with changes: (text, what stands in its place)."""
        text = (contactfpga.examples() / "net" / f"{name}.json5").read_text(encoding="utf-8")
        for before, after in changes:
            assert before in text
            text = text.replace(before, after)
        text = text.replace("tls/localhost:7447", endpoint or self.endpoint)
        for file in ("key.pem", "old-key.pem", "certificate.pem", "old.pem", "authority.pem", "other.pem", "users.txt"):
            text = text.replace(f'"{file}"', f'"{self.folder}/{file}"')
        self._count += 1
        path = self.folder / f"{name}-{self._count}.json5"
        path.write_text(text)
        return str(path)

    def port(self, *changes):
        return patient(f"zenoh://left?config={self.config('read', *changes)}")


@pytest.fixture
def keys(tmp_path):
    if not shutil.which("openssl"):
        pytest.skip("no openssl")
    return Keys(tmp_path)


STRANGERS = [
    ("a long password", "a guess"),
    ('"robot"', '"nobody"'),
    ('auth: { usrpwd: { user: "robot", password: "a long password" } },', ""),
    ('"authority.pem"', '"other.pem"'),
]
"""A wrong password, a user that is not known, none, and an authority that did not sign the certificate."""


def test_certificates_and_users_as_in_the_example(keys, monkeypatch):
    other = keys.folder / "other"
    other.mkdir()
    subprocess.run(AUTHORITY.split(), cwd=other, check=True, capture_output=True, timeout=250)
    shutil.copy(other / "authority.pem", keys.folder / "other.pem")
    with (
        Streaming(SKIN) as streaming,
        publish(streaming.path, "--config", keys.config("publish"), "--key", "left") as one,
    ):
        assert one.line.startswith("zenoh://left"), one.end()
        assert_loopback_alone(one.process.pid)
        with contactfpga.open(keys.port(), timeout=LONG) as board, session.connected(config=keys.config("read")) as bad:
            assert board.read(LONG)
            bad.put("left/bytes", Message(1, 0, 0, 0, 0, b"x").encode())
            assert board.read(LONG)
            assert board.stats.net.refused == 0, "a reader cannot publish"
        monkeypatch.setattr(session, "CONNECT_MS", 600)
        monkeypatch.setattr(net_port, "FOUND_S", 0.5)
        for change in STRANGERS:
            with pytest.raises(
                contactfpga.PortNotFound, match=r"cannot connect there: .*are certificates, user and pass"
            ):
                contactfpga.open(keys.port(change))
        with pytest.raises(contactfpga.PortNotFound, match=r"cannot connect there: .*something listens there"):
            contactfpga.open(f"zenoh://left?connect={keys.endpoint.replace('tls', 'tcp')}")
        monkeypatch.setattr(session, "CONNECT_MS", 60_000)
        with pytest.raises(contactfpga.PortNotFound, match=r"nobody publishes it.*do its access rules let this user"):
            contactfpga.open(keys.port(('"robot"', '"visitor"'), ("a long password", "a ticket")))


def test_an_expired_certificate_and_files_that_are_not_there(keys, monkeypatch):
    keys.make(ASKED, EXPIRED)
    monkeypatch.setattr(session, "CONNECT_MS", 600)
    old = (('"certificate.pem"', '"old.pem"'), ('"key.pem"', '"old-key.pem"'))
    with session.listening(config=keys.config("publish", *old)):
        with pytest.raises(
            contactfpga.PortNotFound, match=r"are certificates, user and password those that it asks for"
        ):
            contactfpga.open(keys.port())
    for name, file, setting, opened in (
        ("publish", "key.pem", "transport/link/tls/listen_private_key", session.listening),
        ("publish", "users.txt", "transport/auth/usrpwd/dictionary_file", session.listening),
        ("read", "authority.pem", "transport/link/tls/root_ca_certificate", session.connected),
    ):
        config = keys.config(name, (f'"{file}"', '"nowhere"'))
        with pytest.raises(contactfpga.ContactFPGAError, match=rf"{setting} is 'nowhere'; there is no such file$"):
            opened(config=config)


def test_who_may_read_but_not_ask_is_told(keys):
    config = keys.config("publish", ('rules: ["read", "ask", "send"]', 'rules: ["read", "send"]'))
    source = SmallPort(SKIN)
    with session.listening(config=config) as network, published(source, network, "left"):
        with pytest.raises(contactfpga.BoardSilent, match=r"not one byte came"):
            contactfpga.open(keys.port(), timeout=0.5)
        source.go(200.0)

        def refused(timeout_s):
            with pytest.raises(contactfpga.ReadTimeout) as caught:
                contactfpga.open(keys.port(), timeout=timeout_s)
            return str(caught.value)

        step = "if there are access rules, let this program write to KEY/ask"
        assert step in patiently(refused, lambda said: step in said)
    assert source.heard == 0


def test_who_may_not_read_the_bytes_is_told(keys, monkeypatch):
    config = keys.config("publish", ('["left/bytes", "left/alive/*"]', '["left/alive/*"]'))
    with session.listening(config=config) as network, published(SmallPort(SKIN), network, "left"):
        monkeypatch.setattr(net_port, "FOUND_S", 0.5)
        with pytest.raises(contactfpga.PortNotFound, match=r"nobody publishes it; .*let this user read KEY/bytes"):
            contactfpga.open(keys.port(), timeout=0.5)


def port(endpoint):
    return patient(f"zenoh://left?connect={endpoint}")


def test_commands_and_what_no_host_sends_do_not_reach_the_board(endpoint):
    source, command = SmallPort(SKIN), encode_command(0x10101, Command(1, 5))
    with session.listening(endpoint) as network, published(source, network, "left"):
        with contactfpga.open(port(endpoint), timeout=LONG) as board, session.connected(endpoint) as stranger:
            for data in (command, b"\0\1\2\3\0", bytes(MOST_ASKED + 1), b"", command + bytes(1000)):
                stranger.put("left/ask", data)
            wait_until(lambda: board.stats.net.denied == 5)
            assert board.read(LONG)
    assert source.commanded == []


def test_commands_pass_where_that_was_asked_for(endpoint):
    with FakeBoard(SKIN.replace(report="cells")) as source:
        with publish(source.path, "--listen", endpoint, "--allow-commands") as one:
            with contactfpga.open(patient(one.line), timeout=LONG) as board:
                board.sample_at(0, LONG)
    assert {*source.commanded} == {(2, 0)}  # asked again where the answer is late, as on a busy machine


def test_a_command_that_is_denied_says_so(endpoint):
    skin = SKIN.replace(self_test=True, scan="reversal", precharge_us=2.0)
    source = SmallPort(skin)
    with session.listening(endpoint) as network, published(source, network, "left"):
        with contactfpga.open(port(endpoint), skin, timeout=LONG) as board:
            for command in (board.self_test, lambda timeout_s: board.command(1, timeout=timeout_s)):

                def refused(timeout_s, command=command):
                    with pytest.raises((contactfpga.NoSuchCommand, contactfpga.ReadTimeout)) as caught:
                        command(timeout_s)
                    return caught.value

                error = patiently(refused, lambda error: isinstance(error, contactfpga.NoSuchCommand))
                assert isinstance(error, contactfpga.NoSuchCommand)
                assert re.search(r"passes on no commands; .*--allow-commands", str(error))
            assert board.read(LONG)
            assert board.stats.net.denied >= 2
    assert source.commanded == []


def test_a_second_publisher_of_a_key_is_refused(endpoint, capsys):
    with session.listening(endpoint) as network, published(SmallPort(SKIN), network, "left"), FakeBoard(SKIN) as other:
        arguments = ["publish", other.path, "--connect", endpoint, "--key", "left", "--timeout", "60"]
        assert cli.main(arguments) == 1
        errors = capsys.readouterr().err
        assert "key is 'left'; it is published already; end that publisher, or give this one --key" in errors
        assert errors.count("\n") == 1
        with contactfpga.open(port(endpoint), timeout=LONG) as board:
            assert board.read(LONG)


def test_what_is_far_too_large_goes_no_further(endpoint):
    """Zenoh would hold up to 1 GiB of it."""
    found = []
    with session.listening(endpoint) as network, session.connected(endpoint) as sender:
        network.declare_subscriber("left/ask", lambda sample: found.append(len(sample.payload)))
        wait_until(lambda: sender.put("left/ask", b"x") or found)
        sender.put("left/ask", bytes(20 << 20))
        wait_until(lambda: sender.put("left/ask", b"xy") or 2 in found)
        time.sleep(0.1)
    assert set(found) == {1, 2}


def listening():
    return {one.laddr for one in psutil.Process().net_connections("inet") if one.status in ("LISTEN", "NONE")}


def test_a_reader_listens_nowhere_whatever_its_configuration_leaves_open(endpoint, tmp_path):
    """Zenoh's own peers listen on all interfaces."""
    config = tmp_path / "peer.json5"
    config.write_text('{ mode: "peer" }')
    with session.listening(endpoint):
        before = listening()
        assert before
        with session.connected(endpoint, str(config)):
            assert listening() == before
