"""`contactfpga latency`: what it prints, what it refuses, its stages, and the figures of the examples."""

import functools
import json
import os

import numpy as np
import pytest
from bridge_oracle import brute
from reversal import FAST, small

from contactfpga import examples
from contactfpga.boards import BOARDS
from contactfpga.skin import Skin
from contactfpga_sim.apps.latency import board as latency
from contactfpga_sim.apps.latency import host, stages
from contactfpga_sim.apps.latency.host import HostShare
from contactfpga_sim.apps.latency.spread import MixedTimes
from contactfpga_sim.apps.latency.usb import BridgeSettings

FILE = str(examples() / "fast.toml")


@pytest.fixture
def run(run):
    """Runs `contactfpga latency`; returns status, output and errors."""
    return functools.partial(run, "latency")


@pytest.mark.slow
@pytest.mark.parametrize("cells", ["1x1", "2x5", "16x16"])
def test_the_figures_are_reported_in_words(run, cells):
    status, out, _ = run("--skin", FILE, "--cells", cells, "--touches", "2", "--exact")
    assert status == 0
    assert "16x16, scan 'reversal', 24 MHz, 12 Mbaud" in out
    assert f"{cells} cells at " in out
    for title in ("touch to last byte", "touch to contact pin", "frames per second", "bytes"):
        assert title in out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--cells", "20x20"), "20x20 cells; the sheet has 16x16"),
        (("--cells", "3x17"), "3x17 cells; the sheet has 16x16"),
        (("--skin", "no-such.toml"), "no-such.toml"),
        (("--board", "no-such"), "no board is called 'no-such'; known are icebreaker"),
        (("--board", "ulx3s-12f", "--skin", FILE), "baud is 12000000, the FT231X reaches 3000000 at most"),
        (("--picture", "stages.pdf"), "--picture is 'stages.pdf'; it must end in .svg or .png"),
    ],
)
def test_errors_are_one_line(run, words, message):
    status, out, err = run(*words)
    assert (status, out) == (1, "")
    assert message in err
    assert err.count("\n") == 1


SIZES = ("0x3", "3x0", "3", "axb", "100x1", "3x3x3", "", "٣x٣")


@pytest.mark.parametrize(
    ("option", "value", "says"),
    [
        *(("--cells", size, "write rows x columns of the contact, such as 3x3") for size in SIZES),
        *(("--timer", value, "is not a whole number from 1 to 255 ms") for value in ("0", "256", "1.5", "x")),
    ],
)
def test_what_no_option_takes_is_refused(run, option, value, says):
    status, _, errors = run(option, value)
    assert status == 2
    assert says in " ".join(errors.split())


def test_a_contact_has_no_masked_switches():
    """They are never reported, so nobody can wait for them."""
    skin = small(rows=3, columns=3, mask=((0, 0), (0, 1), (1, 1)))
    found = latency.places(skin, 1, 2)
    assert all(cells.any() and not cells[0, 0] and not cells[1, 1] for cells in found)
    assert len(found) == 5, "one of six places has masked switches only"
    assert sum(cells.sum() for cells in latency.places(skin, 1, 1)) == 6


def test_places_are_all_places():
    found = latency.places(FAST, 3, 5)
    assert len(found) == 14 * 12 == len({cells.tobytes() for cells in found})
    assert all(cells.sum() == 15 and np.ptp(np.nonzero(cells)[0]) == 2 for cells in found)


@pytest.mark.campaign  # it has a board to compile
def test_touches_that_always_meet_a_keep_alive_end_with_a_sentence():
    skin = Skin(rows=4, columns=4, send="on_change", keep_alive_ms=0.06)
    with pytest.raises(latency.Late, match=r"keep_alive_ms is 0\.06, measure with a longer one"):
        latency.measure(skin, (1, 1), 2)


@pytest.fixture(scope="module")
def exact():
    """Four touches of the reference sheet, without the host."""
    settings = BridgeSettings(BOARDS["icebreaker"].bridge)
    return stages.measure(Skin(), settings, touches=4, host_touches=0)


@pytest.mark.slow
def test_the_way_to_the_host_is_that_of_each_touch_in_each_phase(exact):
    """Against a chip stepped by hand through the bytes that the gateware sent."""
    mhz, period = Skin().clock_hz / 1e6, exact.settings.period_us
    touch_us, bridge_us = [], []
    for touch in exact.board.recorded:
        assert touch.stream.times[touch.byte] == touch.last
        assert touch.stream.values[touch.byte] == 0
        origin = touch.stream.since / mhz
        for number in range(1000):
            at = brute(exact.settings, mhz, touch.stream, touch.byte, origin + period * (number + 0.5) / 1000)
            touch_us.append(at)
            bridge_us.append(at - touch.last / mhz)
    for found, times in ((exact.usb_us, touch_us), (exact.bridge_us, bridge_us)):
        assert found.median == pytest.approx(np.median(times), abs=1)
        assert found.p99 == pytest.approx(np.quantile(times, 0.99), abs=1)
        assert found.worst == pytest.approx(max(times), abs=1)


def test_a_sheet_that_sends_each_scan_waits_a_microframe_at_most(exact):
    """No timer runs out between two frames, so each delimiter goes at the next microframe: to the digit."""
    most = max(touch.last for touch in exact.board.recorded) / 12 + 125
    assert most + 1 < exact.usb_us.worst < most + 8 * (55 + 2 + 2 * 17) / 480
    assert exact.bridge_us.median == pytest.approx(62.5 + 8 * (55 + 2 + 17) / 480, abs=0.1)
    assert exact.usb_us.worst == pytest.approx(exact.board.touch_to_last_byte_us.worst + exact.bridge_us.worst, abs=0.5)


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="no pseudo-terminals")
def test_the_host_has_a_row_of_its_own_with_its_machine(monkeypatch):
    """No value is tested: they are this machine's, and what else runs on it decides them."""
    settings = BridgeSettings(BOARDS["icebreaker"].bridge)
    skin = Skin()
    monkeypatch.setattr(host, "LATE_S", 60.0)  # however busy this machine is
    share = host.measured(skin, settings, latency.places(skin, 3, 3), 3)
    assert (share.touches, share.left_out) == (3, 0)
    assert 0 < share.us.median <= share.us.p99 <= share.us.worst
    assert "Python 3" in share.machine
    assert "cores" in share.machine


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="no pseudo-terminals")
def test_touches_that_were_not_played_in_time_are_left_out(monkeypatch):
    monkeypatch.setattr(host, "LATE_S", -1.0)
    settings = BridgeSettings(BOARDS["icebreaker"].bridge)
    assert host.measured(Skin(), settings, latency.places(Skin(), 3, 3), 1) is None


def test_all_rows_and_the_picture(run, tmp_path, monkeypatch):
    """With a host whose times are known."""
    times = MixedTimes.of([100.0, 300.0])
    share = HostShare(times.spread(), 2, 1, "a machine, 2 cores", times)
    monkeypatch.setattr(host, "measured", lambda *_: share)
    picture = tmp_path / "stages.svg"
    status, out, _ = run("--touches", "2", "--picture", picture)
    assert status == 0
    rows = {line[:22].strip(): line[22:] for line in out.splitlines()}
    assert rows["bridge"] == "FT2232H of iCEBreaker, asked every 125 us, latency timer 1 ms, event character 0"
    assert rows["host to user code"].startswith("200.0 us median, 300.0 us 99 %, 300.0 us worst, measured by 2 touches")
    assert rows["measured on"] == "a machine, 2 cores"
    worst = [
        float(rows[title].replace(" us worst", "").split(", ")[2].split()[0])
        for title in ("touch to host", "touch to user code")
    ]
    assert worst[1] == pytest.approx(worst[0] + 300, abs=0.11)
    assert "host" not in rows["touch to last byte"]
    drawn = picture.read_text()
    assert all(
        f">{title}<" in drawn for title in ("touch to last byte", "last byte to host", "host to user code", "the paper")
    )


@pytest.mark.slow
def test_settings_of_the_bridge_are_reported(run):
    status, out, _ = run(
        "--board", "icebreaker", "--touches", "1", "--exact", "--timer", "2", "--no-event-char", "--json"
    )
    assert status == 0
    found = json.loads(out)
    assert found["bridge"] == {
        "chip": "FT2232H",
        "frame_us": 125,
        "latency_timer_ms": 2,
        "event_character": None,
        "requests_per_frame": 1,
    }
    assert found["host"] is None
    assert found["touch_to_user_code_us"] is None
    late, board = found["touch_to_host_us"], found["touch_to_last_byte_us"]
    assert board["worst"] < late["median"] < late["worst"] < board["worst"] + 2000 + 20
