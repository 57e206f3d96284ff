"""Changes of the reference Skin that are refused, with what is said."""

CLOSED = {"surface": "cylinder", "radius_mm": 25, "closed": True}
REVERSAL = {"scan": "reversal", "precharge_us": 0.25}
FALLS = {"report": "cells", "ruler": 16, "guard": True, "precharge_us": 1.0}
REFUSED = [
    ({"name": 7}, "name is 7; it must be a string"),
    ({"name": " a"}, "name is ' a'; it must be printable, with no spaces around it"),
    ({"name": "ä" * 17}, f"name is '{'ä' * 17}', 34 bytes of UTF-8; at most 32 are possible"),
    # faults
    ({"guard": 1}, "guard is 1; it must be true or false"),
    ({"fail_safe": "yes"}, "fail_safe is 'yes'; it must be true or false"),
    ({"alive": 0}, "alive is 0; it must be true or false"),
    ({"dual": None}, "dual is None; it must be true or false"),
    (
        {"guard": True, "diodes": "none", "connectivity": 4},
        "diodes is 'none'; guard = true closes switches for good and needs 'col2row' or 'row2col'",
    ),
    ({"ruler": 16}, "ruler is 16; columns that fall need guard = true, precharge_us and scan = 'raster'"),
    ({"ruler": 256}, "ruler is 256; it must lie between 0 and 255"),
    ({"harder": 4}, "harder is 4; it must be a list of whole numbers"),
    ({"harder": [4, 1.5]}, "harder is [4, 1.5]; it must be a list of whole numbers"),
    ({**FALLS, "harder": [16, 4, 1]}, "harder has 3 levels; 2 are possible, as a cell has two bits"),
    ({**FALLS, "harder": [4, 4]}, "harder has 4 after 4; each level is from 1 to below the lighter one's ruler"),
    ({"harder": [4]}, "harder has 4 after 0; each level is from 1 to below the lighter one's ruler"),
    ({**FALLS, "harder": [4, 0]}, "harder has 0 after 4; each level is from 1 to below the lighter one's ruler"),
    ({**FALLS, "harder": [4], "report": "moments"}, "report is 'moments'; harder levels need report = 'cells'"),
    (
        {**FALLS, "harder": [4], "debounce": "sym_defer_pk"},
        "debounce is 'sym_defer_pk'; harder levels need debounce = 'none'",
    ),
    (
        {**FALLS, "harder": [4], "surface": "cylinder", "radius_mm": 40.0, "closed": True},
        "closed is true; harder levels need closed = false",
    ),
    ({"self_test": True}, "scan is 'raster'; self_test = true drives and reads all lines and needs 'reversal'"),
    ({"row_order": [0, 1.5]}, "row_order is [0, 1.5]; it must be a list of whole numbers"),
    ({"rows": 2, "row_order": [0, 0]}, "row_order must hold each line from 0 to 1 once; line 0 stands in it 2 times"),
    ({"columns": 2, "column_order": [1, 0, 2]}, "column_order must hold each line from 0 to 1 once; it has 3"),
    # pressure units
    ({"units": 9}, "units is 9; MCP3208 has 8 channels"),
    ({"units": -1}, "units is -1; MCP3208 has 8 channels"),
    (
        {"units": 2, "converter": "ads"},
        "converter is 'ads'; it must be one of 'mcp3208', 'ads131m08', or 'module:attribute' of your own",
    ),
    ({"units": 2, "converter_v": 2.5}, "converter_v is 2.5; MCP3208 needs 2.7 to 5.5 V"),
    ({"units": 2, "converter_v": 6}, "converter_v is 6.0; MCP3208 needs 2.7 to 5.5 V"),
    ({"converter_v": 5.0}, "converter_v is 5.0; leave it out, or set units"),
    ({"unit_sums": [[1]]}, "unit_sums holds [1]; it must hold a weight for each of 0 units, not all 0"),
    ({"unit_sums": 3}, "unit_sums is 3; it must be a list of at most 4 lists of weights"),
    (
        {"units": 1, "unit_sums": [[1]] * 5},
        "unit_sums is [[1], [1], [1], [1], [1]]; it must be a list of at most 4 lists of weights",
    ),
    ({"units": 1, "unit_sums": [[0]]}, "unit_sums holds [0]; it must hold a weight for each of 1 units, not all 0"),
    ({"units": 2, "unit_sums": [[1]]}, "unit_sums holds [1]; it must hold a weight for each of 2 units, not all 0"),
    ({"units": 2, "unit_sums": [[1, 128]]}, "unit_sums holds [1, 128]; weights are whole numbers from -127 to 127"),
    # the sheet
    ({"rows": 65}, "rows is 65; it must lie between 1 and 64"),
    ({"rows": True}, "rows is True; it must be a whole number"),
    ({"pitch_x_mm": True}, "pitch_x_mm is True; it must be a finite number"),
    ({"columns": 8.0}, "columns is 8.0; it must be a whole number"),
    ({"pitch_x_mm": 0}, "pitch_x_mm is 0.0; it must lie between 0.01 and 1000.0 mm"),
    ({"pitch_y_mm": 1001}, "pitch_y_mm is 1001.0; it must lie between 0.01 and 1000.0 mm"),
    ({"pitch_x_mm": float("nan")}, "pitch_x_mm is nan; it must be a finite number"),
    ({"connectivity": 8.0}, "connectivity is 8.0; it must be one of 4, 8"),
    ({"connectivity": 6}, "connectivity is 6; it must be one of 4, 8"),
    ({"mask": [(0, 1.0)]}, "mask holds (0, 1.0); it must hold [row, column] pairs"),
    # its surface
    ({"surface": "sphere"}, "surface is 'sphere'; it must be one of 'plane', 'cylinder'"),
    ({"radius_mm": 50}, "radius_mm is 50.0; a plane has none, leave it out"),
    ({"surface": "cylinder"}, "radius_mm is missing; surface = 'cylinder' needs it"),
    ({"surface": "cylinder", "radius_mm": 0.05}, "radius_mm is 0.05; it must lie between 0.1 and 100000.0 mm"),
    (
        {"surface": "cylinder", "radius_mm": 1.0, "columns": 1},
        "1 columns of 10.0 mm take 10 mm of a circumference of 6.28319 mm: the sheet's ends meet; set "
        "closed = true, or use a larger radius_mm or a smaller pitch_x_mm",
    ),
    ({"closed": 1}, "closed is 1; it must be true or false"),
    ({"closed": True}, "surface is 'plane'; closed = true needs surface = 'cylinder' and radius_mm"),
    ({**CLOSED, "columns": 2}, "columns is 2; closed = true needs at least 3"),
    (
        {**CLOSED, "pitch_x_mm": 9.9},
        "pitch_x_mm is 9.9; 16 columns around a radius of 25 mm have 9.81748 mm, leave it out",
    ),
    (
        {**CLOSED, "radius_mm": 20_000.0},
        "16 columns around a radius of 20000 mm have a pitch of 7853.98 mm; it must lie between 0.01 and 1000.0 mm",
    ),
    ({**CLOSED, "labeller": "single"}, "labeller is 'single'; closed = true needs labeller = 'run' or 'serial'"),
    (
        {**CLOSED, "report": "barycenter"},
        "report is 'barycenter'; closed = true needs report = 'moments' or 'cells'",
    ),
    ({**CLOSED, "diodes": "none", "connectivity": 4}, "diodes is 'none'; closed = true needs 'col2row' or 'row2col'"),
    # its mask
    ({"mask": [3]}, "mask holds 3; it must hold [row, column] pairs"),
    ({"mask": 3}, "mask is 3; it must be a list of [row, column]"),
    ({"mask": [(0, -1)]}, "mask holds [0, -1]; the sheet has 16 rows and 16 columns"),
    ({"mask": [(16, 0)]}, "mask holds [16, 0]; the sheet has 16 rows and 16 columns"),
    ({"rows": 1, "columns": 1, "mask": [(0, 0)]}, "mask lists all 1 switches; at least one must be left"),
    # scan and debounce
    ({"diodes": "both"}, "diodes is 'both'; it must be one of 'col2row', 'row2col', 'none'"),
    (
        {"diodes": "none", "connectivity": 4, "report": "barycenter"},
        "report is 'barycenter'; diodes = 'none' needs report = 'moments' or 'cells'",
    ),
    ({"diodes": "none"}, "connectivity is 8; diodes = 'none' needs connectivity = 4 with report = 'moments'"),
    (
        {"diodes": "none", "report": "cells", "row_drive": "74hc595"},
        "row_drive is '74hc595'; diodes = 'none' needs row_drive = 'direct'",
    ),
    (
        {"diodes": "none", "connectivity": 4, "labeller": "projection"},
        "labeller is 'projection'; diodes = 'none' needs labeller = 'run' with report = 'moments'",
    ),
    (
        {"diodes": "none", "report": "cells", "mask": [(1, 2)]},
        "mask lists 1 switches; diodes = 'none' takes none, as what a masked switch feeds could not be known",
    ),
    (
        {"scan": "adaptive"},
        "scan is 'adaptive', which no longer exists; use 'reversal' with precharge_us if the pins can drive and read "
        "both rows and columns, otherwise 'raster'",
    ),
    ({"settle_us": 0}, "settle_us is 0.0; it must be at least one clock, 0.0833333 us"),
    ({"release_us": 0}, "release_us is 0.0; it must be at least one clock, 0.0833333 us"),
    (
        {"settle_us": 0.5},
        "settle_us + release_us is 18 clocks; 16 columns and 64 zones per frame need 22 clocks (1.83333 us) with "
        "labeller = 'run'",
    ),
    (
        {"settle_us": 1.0, "labeller": "serial"},
        "settle_us + release_us is 24 clocks; 16 columns and 64 zones per frame need 27 clocks (2.25 us) with "
        "labeller = 'serial'",
    ),
    (
        {"labeller": "fast"},
        "labeller is 'fast'; it must be one of 'run', 'serial', 'projection', 'single', "
        "or 'module:attribute' of your own",
    ),
    (
        {"debounce": "sym_defer_pk", "debounce_press_us": -1},
        "debounce_press_us is -1.0; it must lie between 0.0 and 393120.0 us",
    ),
    (
        {"debounce": "asym_eager_defer_pk", "debounce_release_us": 393_121},
        "debounce_release_us is 393121.0; it must lie between 0.0 and 393120.0 us",
    ),
    # extents
    ({"extent": 1}, "extent is 1; it must be true or false"),
    ({"extent": True, "labeller": "single"}, "labeller is 'single'; extent = true needs labeller = 'run' or 'serial'"),
    ({"extent": True, "report": "cells"}, "report is 'cells'; extent = true needs report = 'moments' or 'barycenter'"),
    # precharge and line reversal
    (
        {"precharge_us": 0.25, "column_read": "74hc165"},
        "column_read is '74hc165'; precharge_us drives the columns and needs 'direct'",
    ),
    (
        {"precharge_us": 0.25, "diodes": "none", "report": "cells"},
        "diodes is 'none'; precharge_us drives the columns and needs 'col2row' or 'row2col'",
    ),
    ({"precharge_us": -0.25}, "precharge_us is -0.25; it must lie between 0.0 and 10000.0 us"),
    ({"precharge_us": 1e-12}, "precharge_us is 1e-12; it must be at least one clock, 0.0833333 us"),
    ({"project_us": 2.0}, "project_us is 2.0; leave it out, or set scan = 'reversal'"),
    ({"scan": "reversal"}, "precharge_us is 0; scan = 'reversal' drives the columns, and needs a time for it"),
    ({**REVERSAL, "project_us": 0}, "project_us is 0.0; it must be at least one clock, 0.0833333 us"),
    (
        {**REVERSAL, "row_drive": "74hc595"},
        "row_drive is '74hc595'; scan = 'reversal' needs row_drive = 'direct', as it reads the rows",
    ),
    (
        {**REVERSAL, "send": "on_change", "keep_alive_ms": 3.0},
        "keep_alive_ms is 3.0; scan = 'reversal' needs at least 3.072 ms for this sheet",
    ),
    # report and link
    ({"report": "images"}, "report is 'images'; it must be one of 'moments', 'barycenter', 'cells'"),
    ({"report": "barycenter", "barycenter_bits": 9}, "barycenter_bits is 9; it must lie between 0 and 8"),
    ({"barycenter_bits": 3}, "barycenter_bits is 3; leave it out, or set report = 'barycenter'"),
    (
        {"report": "barycenter", "rows": 32, "columns": 32, "zone_capacity": 256},
        "settle_us + release_us is 72 clocks; 32 columns and 256 zones per frame need 90 clocks (7.5 us) "
        "with labeller = 'run' and report = 'barycenter'",
    ),
    ({"send": "never"}, "send is 'never'; it must be one of 'always', 'on_change'"),
    ({"send": "on_change", "keep_alive_ms": 101}, "keep_alive_ms is 101.0; it must lie between 0.0 and 100.0 ms"),
    ({"send": "on_change", "keep_alive_ms": 0.05}, "keep_alive_ms is 0.05; one scan takes 0.096 ms"),
    ({"zone_capacity": 65}, "zone_capacity is 65; it must lie between 1 and 64 for this sheet"),
    # shift registers
    ({"row_drive": "74hc164"}, "row_drive is '74hc164'; it must be one of 'direct', '74hc595'"),
    ({"column_read": "spi"}, "column_read is 'spi'; it must be one of 'direct', '74hc165'"),
    ({"row_chains": 2}, "row_chains is 2; leave it out, or set row_drive = '74hc595'"),
    ({"column_read": "74hc165", "column_chains": 17}, "column_chains is 17; it must lie between 1 and 16"),
    (
        {"columns": 9, "column_read": "74hc165", "column_chains": 4},
        "column_chains is 4; 9 columns in chains of 3 fill 3, set column_chains = 3",
    ),
    (
        {"shift_hz": 4_000_000},
        "shift_hz is 4000000; leave it out, or set row_drive = '74hc595' or column_read = '74hc165'",
    ),
    # clock and line
    ({"clock_hz": 0}, "clock_hz is 0; it must be a whole number of MHz from 1 to 400 MHz"),
    ({"clock_hz": 401_000_000}, "clock_hz is 401000000; it must be a whole number of MHz from 1 to 400 MHz"),
    ({"clock_hz": 12_500_000}, "clock_hz is 12500000; it must be a whole number of MHz from 1 to 400 MHz"),
    ({"baud": 7_000_000}, "baud is 7000000; it must lie between 1200 and 6000000 for this clock"),
    (
        {"baud": 5_000_000},
        "baud is 5000000: a clock of 12000000 Hz misses it by +20.00 %, the limit is 1.5 %; nearest good rates: "
        "4000000, 6000000",
    ),
]
