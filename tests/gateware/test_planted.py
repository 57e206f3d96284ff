"""Faults that once passed the default tests: each is planted in a copy of the gateware, and its test fails there."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[2]
SOURCES = ROOT / "hdl" / "contactfpga_hdl"


class Fault(NamedTuple):
    """``old``, which is there once, is replaced by ``new``; then ``test`` fails."""

    file: str
    old: str
    new: str
    test: str

    def planted(self) -> str:
        """The text of the file with the fault."""
        text = (SOURCES / self.file).read_text()
        assert text.count(self.old) == 1, f"{self.file} has {text.count(self.old)} times, not once: {self.old}"
        return text.replace(self.old, self.new)


GATEWARE = "tests/gateware"
LEVELS = f"{GATEWARE}/test_ruler.py::test_each_frame_is_sampled_where_the_golden_model_says[levels]"
FORMAL = "tests/proofs/test_formal.py::test_the_claim_holds"
FAULTS = {
    "readings go out with a report": Fault("link/other_packets.py",
        "hello_due | self._wire.take_report | frame_waits & ~units_next", "hello_due | frame_waits & ~units_next",
        f"{GATEWARE}/test_units.py::test_board_does_what_the_golden_model_says"),
    "a sweep's region is written as it goes out": Fault("units/pack.py",
        "filling.eq(Mux(packet.taken, sending, waiting))", "filling.eq(waiting)",
        f"{GATEWARE}/test_units.py::test_the_wire_gets_the_newest_sweep_whole_however_late_it_takes_it"),
    "a threshold of one high bit is none": Fault("units/watch.py", "given[place].eq(number != 0)",
        "given[place].eq(number[:17] != 0)", f"{FORMAL}[thresholds of units, 3 units]"),
    "sums of a lone unit go on": Fault("units/watch.py", "Mux(first, 0, totals[0])",
        "Mux(first & (self.sum == 0), 0, totals[0])",
        f"{GATEWARE}/test_units.py::test_readings_and_thresholds_are_the_golden_models_in_every_clock"),
    "a column is let go for one sample": Fault("scan/precharge.py", "low & self.columns | kept", "self.columns | kept",
        f"{GATEWARE}/test_wrong_readings.py::test_at_rest_a_wrong_reading_delays_contact_by_no_more_than_it_lasts"),
    "a stuck column is never tried": Fault("scan/precharge.py", "tries.eq(asked)", "tries.eq(0)",
        f"{GATEWARE}/test_reversal_scanner.py::test_a_stuck_column_is_reported_and_not_driven_until_it_is_tried"),
    "a try ends too soon": Fault("scan/precharge.py",
        "count.eq(count + (self.looks | ~count[: self.apart_bits].all()))",
        "count.eq(Mux(toggles, 60, count + (self.looks | ~count[: self.apart_bits].all())))",
        f"{GATEWARE}/test_wrong_readings.py::test_random_histories_are_the_golden_models_in_every_clock"),
    "contact of several sheets is a gate": Fault("several.py", "m.d.sync += self.contact.eq(",
        "m.d.comb += self.contact.eq(",
        f"{GATEWARE}/test_output_pins.py::test_each_pin_of_several_sheets_comes_from_a_register"),
    "a test keeps the finding of the one before": Fault("scan/self_test.py", "found.eq(bad | found & ~first)",
        "found.eq(bad | found)",
        f"{GATEWARE}/test_self_test.py::test_what_is_reported_follows_from_each_slot_of_one_test_after_the_other"),
    "a line that rises by itself follows others": Fault("scan/self_test.py", " & ~line & ~rises)", " & ~line)",
        f"{GATEWARE}/test_self_test.py::test_what_is_reported_follows_from_each_slot_of_one_test_after_the_other"),
    "a row that rises with a column is bad": Fault("scan/self_test.py", "rows.any() & ~columns.any()", "rows.any()",
        f"{GATEWARE}/test_self_test.py::test_what_is_reported_follows_from_each_slot_of_one_test_after_the_other"),
    "a long precharge is cut": Fault("scan/reversal_cycle.py",
        "min(charge - 1, charge - derived.precharge_clocks + self._listened)", "charge - 1",
        f"{GATEWARE}/test_reversal.py::test_gateware_does_what_the_golden_model_says_and_frames_are_true"),
    "motion without a sample": Fault("scan/reversal_rows.py", "m.If(self.strobe & ~self.pressed & counts)",
        "m.If(~self.pressed & counts)", f"{GATEWARE}/test_reversal_scanner.py"),
    "motion without an empty row": Fault("scan/reversal_rows.py", "m.If(self.strobe & ~self.pressed & counts)",
        "m.If(self.strobe & counts)", f"{GATEWARE}/test_reversal_scanner.py"),
    "motion without a whole row": Fault("scan/reversal_rows.py", "m.If(self.strobe & ~self.pressed & counts)",
        "m.If(self.strobe & ~self.pressed)", f"{GATEWARE}/test_reversal_scanner.py"),
    "motion stays": Fault("scan/reversal_rows.py", "            m.d.sync += self.motion.eq(0)\n",
        "            m.d.sync += self.motion.eq(self.motion)\n", f"{GATEWARE}/test_reversal_scanner.py"),
    "a toggle in a check asks for another one": Fault("scan/reversal_guard.py",
        "self.asked.eq((self.asked | self.due) & ~self.starts)", "self.asked.eq(self.asked & ~self.starts | self.due)",
        f"{GATEWARE}/test_reversal_guard.py::test_checks_at_rest_wait_for_a_turn_after_the_check_of_a_frame"),
    "a toggle in a round's last clock is lost": Fault("scan/guard.py", "renewing.eq(toggled | toggles)",
        "renewing.eq(toggled)",
        f"{GATEWARE}/test_guard.py::test_what_is_reported_is_kept_until_a_renewing_round_finds_it_well"),
    "a toggle in a round's last clock counts twice": Fault("scan/guard.py",
        "renewing.eq(toggled | toggles), toggled.eq(0)]", "renewing.eq(toggled | toggles), toggled.eq(toggles)]",
        f"{GATEWARE}/test_guard.py::test_what_is_reported_is_kept_until_a_renewing_round_finds_it_well"),
    "a clock early is not early": Fault("scan/sample_at.py", "self.early.eq(asked != settle)",
        "self.early.eq(asked < settle - 1)",
        f"{GATEWARE}/test_sample_at.py::test_a_frame_takes_the_last_clock_that_was_asked_for_before_it_begins"),
    "a toggle in a decision is lost": Fault("link/due.py", "m.If(_toggles(m, link, KEEP_ALIVE_BIT) & ~link.due)",
        "m.If(_toggles(m, link, KEEP_ALIVE_BIT) & ~link.due & ~decide)",
        f"{GATEWARE}/test_link.py::test_a_keep_alive_is_due_after_its_turns_whatever_comes_with_them"),
    "what was well in a fault counts": Fault("link/alive.py", "(seen & ~ticks | self.well) & ~self.fault",
        "(seen & ~ticks & ~self.fault) | self.well",
        f"{GATEWARE}/test_safe_pins.py::test_alive_turns_where_all_was_well_since_the_last_tick"),
    "frames between readings are not counted anew": Fault("link/other_packets.py", "[self._frames.eq(0), ", "[",
        f"{GATEWARE}/test_link.py::test_readings_go_after_each_four_frames_that_follow_one_another"),
    "one carry of two is lost": Fault("link/odometer.py", "epoch_waits.eq(epoch_waits & sent_waits)",
        "epoch_waits.eq(0)", f"{GATEWARE}/test_link.py::test_carries_that_come_in_one_clock_are_both_counted"),
    "a pin of two copies is not compared": Fault("dual.py", "second.signature.members.items() if member.flow == Out",
        'second.signature.members.items() if member.flow == Out and name != "alive"',
        f"{GATEWARE}/test_dual.py::test_each_bit_at_each_pin_is_compared_and_heard_by_both"),
    "a bit of the sheet's number is ignored": Fault("link/request.py", "with m.If(self.bits.bit & (place == at)):",
        "with m.If(self.bits.bit & (place == at) & (bit != 3)):",
        f"{GATEWARE}/test_request.py::test_a_sheet_of_several_takes_what_has_its_number_in_every_bit"),
    "the highest bit of the kind is ignored": Fault("link/request.py", "with m.If(bit >= protocol.FLAG_BITS):",
        "with m.If((bit >= protocol.FLAG_BITS) & (bit != 7)):",
        f"{GATEWARE}/test_request.py::test_no_other_kind_is_taken"),
    "a bit of the check is ignored": Fault("link/request.py", "checked = crc == 0", "checked = crc[:15] == 0",
        f"{GATEWARE}/test_request.py::test_each_bit_that_a_wrong_check_leaves_counts"),
    "what the link finds does not restart the board": Fault("top.py", "scan.upset | link.upset", "scan.upset",
        f"{GATEWARE}/test_top.py::test_a_register_that_turns_by_itself_starts_all_but_the_transmitter_anew"),
    "contact rests after a restart": Fault("top.py", "self._restarts | blind & ~_packed(packer)",
        "blind & ~_packed(packer)",
        f"{GATEWARE}/test_top.py::test_a_register_that_turns_by_itself_starts_all_but_the_transmitter_anew"),
    "units raise no contact with fail_safe": Fault("top.py", "scan.contact | over | fault | unwatched",
        "scan.contact | fault | unwatched", f"{GATEWARE}/test_units.py::test_board_does_what_the_golden_model_says"),
    "units without a threshold are safe": Fault("top.py", "scan.contact | over | fault | unwatched",
        "scan.contact | over | fault", f"{GATEWARE}/test_units.py::test_board_does_what_the_golden_model_says"),
    "a line that is reported raises no contact": Fault("top.py",
        'scan.faults.as_value().any() if hasattr(scan, "faults") else 0', "0",
        f"{GATEWARE}/test_safe_pins.py::test_both_pins_are_the_golden_models_in_every_clock"),
    "a sheet at rest is not well": Fault("top.py", "scan.watched if self.derived.scan.waits else 0", "0",
        f"{GATEWARE}/test_safe_pins.py::test_both_pins_are_the_golden_models_in_every_clock"),
    "another command moves the sample": Fault("top.py", "request.what == SAMPLE_AT", "request.what[:6] == SAMPLE_AT",
        f"{GATEWARE}/test_sample_at.py::test_the_whole_board_is_the_golden_models_in_every_clock"),
    "another command starts a self-test": Fault("top.py", "request.what == SELF_TEST", "request.what[:6] == SELF_TEST",
        f"{GATEWARE}/test_self_test.py::test_the_whole_board_is_the_golden_models_in_every_clock"),
    "a high bit of the sample's clock is ignored": Fault("scan/sample_at.py", "clocks < settle", "clocks[:20] < settle",
        f"{GATEWARE}/test_sample_at.py::test_a_frame_takes_the_last_clock_that_was_asked_for_before_it_begins"),
    "another command sets a unit": Fault("units/watch.py", "self.what == what", "self.what[:6] == what",
        f"{GATEWARE}/test_units.py::test_readings_and_thresholds_are_the_golden_models_in_every_clock"),
    "a unit that is not there is another one": Fault("units/watch.py", "index == place", "index[:2] == place",
        f"{GATEWARE}/test_units.py::test_readings_and_thresholds_are_the_golden_models_in_every_clock"),
    "contact is that of two sheets": Fault("several.py", "sheet.contact for sheet in self.sheets",
        "sheet.contact for sheet in self.sheets[:2]",
        "tests/cosim/test_several.py::test_each_of_sixteen_sheets_raises_contact_and_keeps_its_grant"),
    "a report does not keep its grant": Fault("link/link.py", "either | wire.take_report if others", "either if others",
        "tests/cosim/test_several.py::test_guard_lines_alive_and_fail_safe_of_each_sheet"),
    "a masked switch tells of motion": Fault("scan/reversal_rows.py", "touched.eq(self.read & whole)",
        "touched.eq(self.read)", f"{GATEWARE}/test_reversal_scanner.py"),
    "a harder level is sampled a clock early": Fault("scan/levels.py", "slots.clock == ruler.clock)",
        "slots.clock == ruler.clock - 1)", LEVELS),
    "a command for one level moves all": Fault("scan/ruler.py", "moves & (fits | (value == first))", "moves",
        LEVELS),
    "a cell is counted for each bit of its level": Fault("report/audit.py",
        "pressed_cells(self.derived, self.row.cells)", "self.row.cells", LEVELS),
    "a part on the upper turn stays on the lower": Fault("label/extent.py", "right[-1] | above", "right[-1]",
        f"{GATEWARE}/test_label_extent.py"),
    "a zone that winds has the columns of its turns": Fault("label/extent.py", "group.ring | group.wound | laps",
        "group.ring | laps", f"{GATEWARE}/test_label_extent.py"),
    "a zone of more columns than there are does not go around": Fault("label/extent.py",
        "group.ring | group.wound | laps", "group.ring | group.wound", f"{GATEWARE}/test_label_extent.py"),
    "a zone that waits loses its turn": Fault("label/extent.py", "left[-1] & ~above", "left[-1]",
        f"{GATEWARE}/test_label_extent.py"),
    "the extent is that of the zone before": Fault("report/divide.py", "extent[name].eq(zone[name])",
        "extent[name].eq(extent[name])", f"{GATEWARE}/test_divide.py::test_extents_go_with_their_zones"),
    "the time of a row goes on in the debounce": Fault("debounce/timed.py",
        "        with m.If(enters):\n            m.d.sync += now.eq(self.now)\n",
        "        m.d.comb += now.eq(self.now)\n",
        f"{GATEWARE}/test_debounce.py::test_samples_at_uneven_times_follow_the_rule_and_busy_rows_are_reported"),
}  # fmt: skip


@pytest.mark.campaign
@pytest.mark.parametrize("name", FAULTS)
def test_a_planted_fault_is_noticed(name, tmp_path):
    """The named test, which belongs to `make test`, fails with the fault. A test that cannot be collected or does not
    end has noticed nothing."""
    fault = FAULTS[name]
    copy = tmp_path / "contactfpga_hdl"
    shutil.copytree(SOURCES, copy, ignore=shutil.ignore_patterns("__pycache__"))
    (copy / fault.file).write_text(fault.planted())
    folders = map(str, (tmp_path, ROOT / "py", ROOT / "sim"))
    changed = {"PYTHONPATH": os.pathsep.join(folders), "CONTACTFPGA_CACHE": str(tmp_path / "cache")}
    options = ["--quick", "-q", "-x", "-n", "0", "-p", "no:cacheprovider", "--tb=line", "--timeout", "600"]
    command = [sys.executable, "-m", "pytest", *options, fault.test]
    environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1", **changed}
    ended = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=800)
    assert ended.returncode == pytest.ExitCode.TESTS_FAILED, ended.stdout[-2000:]


@pytest.mark.parametrize("fault", FAULTS.values(), ids=FAULTS)
def test_a_fault_can_be_planted(fault):
    """The replaced text is in the source once."""
    assert fault.planted()
