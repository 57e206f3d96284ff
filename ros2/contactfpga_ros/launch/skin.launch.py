"""One skin: `ros2 launch contactfpga_ros skin.launch.py port:=/dev/ttyUSB1 frame:=forearm parent:=base_link`."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import LifecycleNode

ARGUMENTS = {
    "name": ("skin", "Name of the node; its topics are below it."),
    "port": ("", "Serial port, sim:// or replay://FILE. Empty: the one supported board that is plugged in."),
    "frame": ("", "Name of the link's frame. Empty: the board's name, or skin."),
    "parent": ("", "Frame in which it is published on /tf_static. Empty: it is not."),
    "autostart": ("true", "Configure and activate at once."),
}


def generate_launch_description() -> LaunchDescription:
    """The node, with its most used parameters as arguments."""
    declared = [
        DeclareLaunchArgument(name, default_value=value, description=text) for name, (value, text) in ARGUMENTS.items()
    ]
    given = {name: LaunchConfiguration(name) for name in ARGUMENTS if name != "name"}
    node = LifecycleNode(
        package="contactfpga_ros",
        executable="skin",
        name=LaunchConfiguration("name"),
        namespace="",
        parameters=[given],
        output="screen",
    )
    return LaunchDescription([*declared, node])
