"""The robot's description, as RViz and Nav2 read it from /robot_description: URDF."""

from collections.abc import Mapping
from xml.etree import ElementTree as ET

from benchbot.plugin import Pose
from benchbot_robot_ros2.bridge.robot import BridgedRobot


def urdf(robot: BridgedRobot, mounts: Mapping[str, Pose]) -> str:
    """Return a URDF of the base, with the disc that it collides as, and of the frames that are mounted on it.

    All joints are fixed: the declaration says nothing of wheels. http://wiki.ros.org/urdf/XML
    """
    root = ET.Element("robot", name=robot.name)
    base = ET.SubElement(root, "link", name=robot.base_frame)
    footprint = robot.declaration["footprint"]
    low_m, high_m = float(footprint.get("z_min_m", 0.0)), float(footprint.get("z_max_m", 0.0))
    if high_m > low_m:
        for role in ("visual", "collision"):
            part = ET.SubElement(base, role)
            ET.SubElement(part, "origin", xyz=_numbers((0.0, 0.0, (low_m + high_m) / 2)), rpy="0 0 0")
            shape = ET.SubElement(part, "geometry")
            size = {"radius": f"{footprint['radius_m']:g}", "length": f"{high_m - low_m:g}"}
            ET.SubElement(shape, "cylinder", size)
    for frame, pose in mounts.items():
        ET.SubElement(root, "link", name=frame)
        joint = ET.SubElement(root, "joint", name=f"{frame}_joint", type="fixed")
        ET.SubElement(joint, "parent", link=robot.base_frame)
        ET.SubElement(joint, "child", link=frame)
        ET.SubElement(joint, "origin", xyz=_numbers(pose.translation_xyz), rpy=_numbers(pose.rpy_rad))
    ET.indent(root)
    return ET.tostring(root, encoding="unicode", xml_declaration=False)


def _numbers(values: tuple[float, float, float]) -> str:
    return " ".join(f"{value:.9g}" for value in values)
