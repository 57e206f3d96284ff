"""The paper's arm runs into a bar, feels it through its sheet and turns back: `python examples/arm/arm.py`."""

from pathlib import Path

import mujoco
import numpy as np

from contactfpga.mujoco import Sheets

ARM = """<mujoco><option timestep="2.5e-5" gravity="0 0 0" integrator="implicitfast"/>
<default><geom margin="-0.005" gap="0.005"/></default>
<worldbody><body name="arm" euler="0 0 -0.6589"><joint name="joint" axis="0 0 1" armature="0.015"/>
<inertial pos="0.15 0 0" mass="0.6" diaginertia="1e-4 0.0022166 0.0022166"/>
<geom type="capsule" fromto="0.03 0 0 0.3 0 0" size="0.038"/></body>
<body pos="0.2 0.076 0"><geom type="capsule" fromto="0 0 -0.2 0 0 0.2" size="0.038"/></body></worldbody>
<actuator><general joint="joint" dyntype="filterexact" dynprm="1.25e-4" gainprm="2.5"/></actuator></mujoco>"""


def run(way, delay_s=0.0):
    """Peak force in N and reaction in s after the touch; ``way``: `pin`, `usb` (the kit), `switch` or `torque`."""
    model = mujoco.MjModel.from_xml_string(ARM)
    data = mujoco.MjData(model)
    data.qvel[0] = wanted = 0.23 / 0.2
    peak, touched_s, known_s, reacted_s, total = 0.0, None, np.inf, None, 0.0
    with Sheets(model, data, Path(__file__).with_name("robot.toml"), radius_m=0.038, foam=True) as sheets:
        skin = sheets["arm"]
        while data.time < 0.05:
            if round(data.time / 2.5e-5) % 10 == 0:  # the controller samples at 4 kHz
                torque = data.act[0] * 2.5 - 0.015 * data.qacc[0]  # between motor and arm
                if reacted_s is None and (data.time >= known_s + delay_s or torque >= 3.0):
                    wanted, reacted_s = -wanted, data.time
                error = wanted - data.qvel[0]
                current = 6.0 * error + total + 0.15 * error
                data.ctrl[0] = np.clip(current, -1.2, 1.2)
                if abs(current) <= 1.2 or error * current < 0:
                    total += 0.15 * error
            sheets.step()
            force = sum(touch.push_n for touch in skin.touches)
            peak = max(peak, force)
            touched_s = data.time if touched_s is None and force else touched_s
            zones = sheets.snapshot().links["arm"].zones if way == "usb" else None
            if {"pin": skin.contact, "usb": bool(zones), "switch": skin.closed.any(), "torque": False}[way]:
                known_s = min(known_s, data.time)
    return peak, reacted_s - touched_s


if __name__ == "__main__":
    for name, *how in (("torque limit alone", "torque"), ("6 ms", "switch", 6e-3), ("kit", "usb"), ("pin", "pin")):
        force_n, late_s = run(*how)
        print(f"{name:20}{1e3 * late_s:6.2f} ms after the touch, at most {force_n:.1f} N")
