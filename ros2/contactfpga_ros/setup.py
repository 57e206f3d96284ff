"""How colcon installs the package."""

from setuptools import setup

NAME = "contactfpga_ros"

setup(
    name=NAME,
    version="0.3.0",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", ["launch/skin.launch.py"]),
    ],
    install_requires=["setuptools", "contactfpga"],
    zip_safe=True,
    maintainer="the contactfpga authors",
    maintainer_email="contactfpga@users.noreply.github.com",
    description="Publishes what a robot skin of on/off switches feels.",
    license="ISC",
    entry_points={"console_scripts": [f"skin = {NAME}.skin:main"]},
)
