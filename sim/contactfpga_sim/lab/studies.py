"""All studies, in the order of their names."""

from __future__ import annotations

from contactfpga_sim.lab.registry import NO_ROW, Section, Study

_ALL = (
    Study(
        "arm",
        title="A robot arm that meets a person",
        page="arm.md",
        minutes=12,
        sections={
            "matters": Section("tables:matters_text"),
            "places": Section(
                "tables:places_table",
                kept=r"^\| (flush, .*|buttons|tiles) \| 10 \| 1 \| 5 |^\| tiles \| 6.4 \| 0.4 \| 5 ",
                heads="^(?!pressed|limit alone)",
            ),
            "effects": Section(
                "tables:effects_table",
                kept=NO_ROW,
            ),
            "set": Section(
                "tables:set_table",
                kept=r"^\| (reacts|speed stays|contact force|peak force)",
                heads="^$|^(paper|set|6 ms|UART|pin|limit)",
            ),
            "sheet": Section("tables:sheet_table", heads="^(?!touches|bound)"),
            "speeds": Section("tables:speed_table", heads="^(?!.*δ)"),
            "defense": Section("tables:defense_table", kept="switch"),
            "pushes": Section("tables:push_table", sample="tables:push_table", kept=NO_ROW),
            "failures": Section(
                "tables:failure_table",
                kept="nothing wrong|halfway between|patch's|nobody waits|dies before",
                heads="^$|reacts|because|peak|reversals",
            ),
            "steps": Section("tables:step_table", kept=NO_ROW),
        },
        compute="tables:compute",
        pictures="tables:draw",
    ),
    Study(
        "body",
        title="A robot of several sheets",
        page="body.md",
        minutes=4,
        sections={
            "outages": Section("tables:outages_table", kept="unplugged|sends nothing|another Skin"),
            "registration": Section(
                "tables:registration_table",
                kept=r"^\| (plane|cyl).*, with normals|^\|  \| 6 \| 0",
                heads="^(?!wrongly|residual)",
            ),
            "folds": Section("tables:folds_table", kept=r"^\| 5 ", sample="tables:folds_sample"),
        },
        pictures="picture:draw",
        extra="test",
        needs=("chromium",),
    ),
    Study(
        "c",
        title="Memory and code of the C header on microcontrollers",
        page="c.md",
        minutes=1,
        sections={
            "c": Section("tables:sizes_table"),
        },
        needs=("arm-none-eabi-gcc",),
    ),
    Study(
        "chart",
        title="Speed against accuracy",
        page="chart.md",
        minutes=25,
        sections={
            "front": Section("tables:front_table", kept=r"\*\*", heads="family|touch|miscounted|barycenter"),
            "families": Section(
                "tables:families_table",
                kept=r"^\| run, 6.4 mm, (tiles|paper) \| \d",
            ),
            "methods": Section(
                "tables:methods_table",
                kept=r"^\| (?!barycenter|single)\w+, 6.4 mm, tiles \|",
                heads="method|touch|alone|miscounted|barycenter|LUT4",
            ),
            "host": Section("tables:host_table", kept=r"\| (10|29|92) \|", heads="^(?!labelled|faster)"),
            "floor": Section("limits:floor_table", kept=NO_ROW),
            "other_ways": Section(
                "limits:rivals_table",
                kept=r"^\| (analog array, 1 kHz|micro.*UART|OpenCV).* 6.4 mm ",
                heads="^(?!pitch|missed|lines|assumes)",
            ),
        },
        compute="tables:compute",
        pictures="tables:draw",
        extra="chart",
    ),
    Study(
        "clock",
        title="Board time on the host's clock, over simulated ways to the host",
        page="clock.md",
        minutes=1,
        sections={
            "accuracy": Section(
                "tables:accuracy_table",
                kept=r"microframes|1 ms \||16 ms|network",
                heads="^(?!error within)",
                sample="tables:slow_sample",
            ),
        },
    ),
    Study(
        "closed",
        title="Cost of labelling over the seam of a closed sheet",
        page="labelling.md",
        minutes=5,
        sections={
            "closed": Section("tables:clocks_table", kept=NO_ROW, sample="tables:clocks_sample"),
            "closed_size": Section("tables:size_table", kept=r"^\| `\w+` \| 8 ", of_netlists=True),
        },
        extra="boards",
    ),
    Study(
        "cover",
        title="Formulas for covers of foam against integrals and the paper",
        page="cover.md",
        minutes=3,
        sections={
            "closes": Section(
                "caps:felt_table",
                kept=r"(6.4|10) mm.*the paper|6.4 mm.*(caps, gaps|tiles)",
                heads="pitch|presses|50 %|99 %",
                sample="caps:felt_sample",
            ),
            "elements": Section("caps:elements_table", page="paper.md", kept=r"^\| 5 mm \| [48]"),
            "sags": Section("caps:sagging_table", page="paper.md", kept="6.4 mm", sample="caps:sagging_table"),
            "paper": Section(
                "tables:paper_table",
                page="paper.md",
                kept="misprint|wrong;|not reproduce|inconsistent|bottoms|fails|vacuous|low by",
                sample="tables:paper_table",
            ),
            "rules": Section("tables:rules_table", page="paper.md", kept=r"\*\*"),
            "failing": Section("tables:failing_table", page="paper.md", kept=NO_ROW),
            "sense": Section("tables:sense_table", kept=NO_ROW),
            "thinning": Section(
                "tables:thinning_table",
                kept=r"^\| (6|0.895|0.252) ms",
                heads="^(?!the paper|in the)",
                sample="tables:thinning_table",
            ),
            "foams": Section(
                "tables:foam_table",
                kept=r"^\| (PORON 4701-30, 320|Plastazote|Sylodyn)",
                heads="^(?!source)",
                sample="tables:foam_table",
            ),
        },
        pictures="tables:draw",
        extra="test",
    ),
    Study(
        "failures",
        title="One knob after another until something breaks",
        page="failures.md",
        minutes=10,
        sections={
            "failures": Section(
                "tables:table",
                kept=r"^\| \[(?![^]]*, by line reversal).*\*\*not noticed",
                heads="knob|at$|helps",
            ),
            "closed": Section("tables:closed", kept=NO_ROW),
            "unnoticed": Section(
                "tables:unnoticed", kept=r"^\| \[.*#(diodes|broken|stuck|silence)\)", heads="knob|why"
            ),
            "pictures": Section("tables:pictures", sample="tables:pictures"),
        },
        compute="tables:compute",
        pictures="tables:draw",
    ),
    Study(
        "fit",
        title="Skins that `contactfpga fit` chooses for the examples",
        page="fit.md",
        minutes=10,
        sections={
            "fingers": Section("tables:fingers_section", kept="23x23|answer", heads="^(?!pitch|bytes)"),
        },
        extra="chart",
    ),
    Study(
        "flips",
        title="Flipped bits of the running gateware",
        page="flips.md",
        minutes=30,
        sections={
            "worst": Section("tables:worst_text"),
            "flipped": Section(
                "tables:designs_table", kept=r"^\| `(run|serial)(, dual)?` .*of registers", heads="^(?!bits|flips)"
            ),
            "modules": Section("tables:modules_table", kept=NO_ROW),
            "ways": Section("tables:ways_table", kept=NO_ROW),
        },
        compute="tables:compute",
        pictures="tables:draw",
        extra="chart",
    ),
    Study(
        "haptics",
        title="Places and forces by pressure units",
        page="haptics.md",
        minutes=5,
        sections={
            "layouts": Section("tables:layouts_table", kept="at one end|best of all", sample="tables:layouts_table"),
            "places": Section(
                "tables:places_table", kept=r"^\| (set \| 5|closings \| 5|center of pressure \| 10)", heads="^(?!over)"
            ),
            "wrong": Section("tables:wrong_table", kept="30 %|drifted", heads="not|^error|radius|covers|reports"),
            "felt": Section("tables:felt_table", kept=NO_ROW),
            "pairs": Section("tables:pairs_table", kept="60 mm"),
            "limits": Section("tables:limits_table", kept=NO_ROW),
            "breaks": Section(
                "tables:breaks_table",
                page="haptics_limits.md",
                kept=r"^\| \[.*not noticed",
                heads="knob|at$|reported|helps",
            ),
            "breakpictures": Section(
                "tables:breaks_pictures", page="haptics_limits.md", sample="tables:breaks_pictures"
            ),
        },
        pictures="tables:draw",
        extra="test",
    ),
    Study(
        "kits",
        title="The kits, from the finger to the host",
        page="kits.md",
        minutes=12,
        sections={
            "kits": Section("tables:headline", page="../README.md"),
            "times": Section("tables:times_table", kept="pin|last byte on|decision"),
            "built": Section("tables:built_table"),
            "pins": Section("tables:pins_table", kept=NO_ROW),
            "parts": Section(
                "tables:parts_table",
                kept=r"^\| fast \| beside",
                heads="count|what|value",
                sample="tables:parts_table",
            ),
            "predictions": Section(
                "tables:predictions_table",
                kept=r"`(contact_worst|break_worst|settle)_us|`felt_half_n",
                heads="^(?!name)",
                sample="tables:predictions_table",
            ),
        },
        compute="tables:compute",
        extra="boards",
    ),
    Study(
        "maker",
        title="The maker's sheet: diodes, pull-ups and series resistors",
        page="maker.md",
        minutes=1,
        sections={
            "diodes": Section("tables:diodes_table", sample="tables:diodes_table"),
            "pulls": Section("tables:pulls_table", kept=r"^\| (10|22|47) k", sample="tables:pulls_table"),
            "series": Section("tables:series_table", kept=r"^\| (none|33|100)", sample="tables:series_table"),
        },
    ),
    Study(
        "mujoco",
        title="An arm with and without skin, and a sheet beside a momentum observer",
        page="mujoco.md",
        minutes=8,
        sections={
            "peaks": Section("clip:peaks_table"),
            "observer": Section("collisions:observer_table", page="collisions.md"),
        },
        pictures="clip:draw",
        extra="test",
        needs=("chromium",),
    ),
    Study(
        "mutants",
        title="Mutants of the netlist that the comparison with the golden model tells",
        page="mutants.md",
        minutes=150,
        sections={
            "mutants": Section("tables:mutants_table", kept=r"^\| all", heads="^(?!stage)"),
            "options": Section("tables:options_table", kept=r"^\| all", heads="^(?!stage)"),
            "several": Section("tables:several_table", kept=r"^\| all", heads="^(?!stage)"),
        },
        compute="tables:compute",
    ),
    Study(
        "net",
        title="Links over a network",
        page="net.md",
        minutes=2,
        sections={
            "batch": Section("tables:batch_table", heads="^(?!messages|ratio)"),
            "links": Section("tables:links_table", kept=r"^\| (1|16|64) ", heads="links|of those|latency"),
            "thousand": Section("tables:thousand_table"),
        },
        pictures="tables:draw",
        extra="test",
    ),
    Study(
        "performance",
        title="Latency, rate and clocks of the gateware",
        page="performance.md",
        minutes=5,
        sections={
            "reference": Section("scans:reference_table", heads="^(?!bytes)", sample="scans:reference_sample"),
            "labeller": Section("labellers:labeller_table", sample="labellers:labeller_sample", kept=NO_ROW),
            "report": Section("scans:report_table", sample="scans:report_sample", kept="reference", heads="^(?!sheet)"),
            "fast": Section("scans:latency_table", heads="^(?!bytes|contact|frames)", sample="scans:latency_sample"),
            "bridges": Section(
                "bridges:bridge_table", kept="1 ms, 0.*reference", page="boards.md", sample="bridges:bridge_sample"
            ),
            "labeller_recorded": Section("labellers:recordings_table", needs=("../shared/data",), kept=NO_ROW),
        },
    ),
    Study(
        "reader",
        title="From the last byte to user code, by a thread and by a process",
        page="performance.md",
        minutes=5,
        sections={
            "reader_rest": Section("tables:rest_table"),
            "reader_busy": Section("tables:busy_table", kept="latest", heads="^(?!calls)"),
            "reader_loop": Section("tables:loop_table", kept="a thread"),
            "reader_links": Section("tables:links_table", kept=r"^\| 64 \| `latest"),
        },
    ),
    Study(
        "recordings",
        title="Size of recordings, and loss by a killed program",
        page="recordings.md",
        minutes=2,
        sections={
            "sizes": Section("tables:sizes_table", kept=r"^\| 10,"),
            "reading": Section("tables:reading_table", kept=NO_ROW),
            "loss": Section("tables:loss_table", kept="worst"),
        },
        extra="test",
    ),
    Study(
        "ros",
        title="Messages to nodes of ROS 2",
        page="ros.md",
        minutes=10,
        sections={
            "costs": Section("scripts/measure_ros.py:costs_table", kept="Contacts|Marker"),
            "shown": Section("scripts/measure_ros.py:shown_table", heads="ROS|by|late"),
        },
        extra="test",
    ),
    Study(
        "safety",
        title="Every electrical fault in the sheet",
        page="safety.md",
        minutes=5,
        sections={
            "coverage": Section("tables:coverage_table", kept=r"^\| (none|`guard`, |these)", heads="options|reported"),
            "faults": Section(
                "tables:faults_table",
                kept="row is broken|stuck closed|does not close|diode is shorted|no supply|wire of",
                heads="^(?!effect|wrong frames|without|time until)",
            ),
            "times": Section("tables:times_table", sample="tables:times_table"),
        },
    ),
    Study(
        "scenes",
        title="The built-in scenes",
        page="scenes.md",
        minutes=1,
        pictures="pictures:draw",
    ),
    Study(
        "settle",
        title="Times that a sheet's circuit needs",
        page="settle.md",
        minutes=2,
        sections={
            "needs": Section("tables:needs_table", kept="nominal|500|64x64, rows"),
            "breaks": Section("tables:breaks_table", kept=r"^\| [A-Z]", heads="^(?!circuit|what breaks)"),
            "shorted": Section("tables:shorted_table", kept=r"^\| [01] ", sample="tables:shorted_table"),
            "summary": Section("tables:summary_table", kept=r"^\| all", needs=("ngspice",)),
            "agreement": Section("tables:agreement_table", kept=NO_ROW, needs=("ngspice",)),
        },
        pictures="pictures:draw",
    ),
    Study(
        "several",
        title="Cost of several sheets at one FPGA",
        page="several.md",
        minutes=3,
        sections={
            "several_line": Section("tables:line_table", kept=r"000 \| [48] \|", sample="tables:line_sample"),
            "several_size": Section("tables:size_table", of_netlists=True),
        },
        extra="boards",
    ),
    Study(
        "sizes",
        title="Size and clock by place and route",
        page="performance.md",
        minutes=60,
        sections={
            "gateware": Section("tables:gateware_table", of_netlists=True, kept="whole", heads="^(?!8x8)"),
            "faults": Section("tables:faults_table", kept="none|guard|self_test|fast", of_netlists=True),
            "units_size": Section("tables:units_table", kept=r"^\| (1|6) ", page="units.md", of_netlists=True),
            "boards": Section("tables:boards_table", page="boards.md", heads="^(?!flip|logic)"),
        },
        extra="boards",
    ),
    Study(
        "skin",
        title="The fields of a Skin file",
        page="skin.md",
        minutes=0.1,
        sections={
            "fields": Section("tables:fields_table", sample="tables:fields_table"),
        },
    ),
    Study(
        "tracking",
        title="Contacts followed over scenes and recordings",
        page="tracking.md",
        minutes=25,
        sections={
            "speed": Section("tables:speed_table", kept=NO_ROW),
            "reflex": Section("tables:reflex_table"),
            "breaks": Section(
                "tables:breaks_table",
                kept="(pass each|bounces|frames are lost).*`Tracker`",
                heads="knob|up to|helps",
            ),
            "scores": Section(
                "tables:scores_table", kept=r"mean of all \| (25|100|10,000) ", heads="scenes|second|IDF1"
            ),
            "ahead": Section("tables:ahead_table", kept=NO_ROW),
            "recorded": Section(
                "tables:recorded_table",
                kept=NO_ROW,
                needs=("../shared/data",),
            ),
        },
        pictures="tables:draw",
        extra="test",
    ),
    Study(
        "units",
        title="Sweep times of pressure units",
        page="units.md",
        minutes=1,
        sections={
            "units": Section(
                "tables:units_table",
                kept=r"\| 6 \|",
                heads="converter|supply|sweep$|packet|Mbaud",
                sample="tables:units_table",
            ),
        },
    ),
    Study(
        "view",
        title="Delay and load of the view in a browser",
        page="view.md",
        minutes=4,
        sections={
            "view_load": Section("tables:loads_table", kept="two", heads="sheet|both"),
            "view_clicks": Section("tables:clicks_table", kept=r"^\| all"),
        },
        compute="tables:compute",
        pictures="tables:draw",
        extra="test",
        needs=("chromium",),
    ),
)
STUDIES = {study.name: study for study in _ALL}
