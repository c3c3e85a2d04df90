"""Poses of the tool by a robot's file, as 4 by 4 matrices, and its limits: `robot.py FORMAT FILE JOINTS [BASE TIP]`.

JOINTS is JSON: a list of vectors of encoder outputs, radians or metres. Limits are those of the encoder outputs, null where the file has none. BASE and TIP are links of a URDF that is a tree. Nothing here is shared with what wrote the file: the file is
read by a library where there is one, and transforms are products of elementary matrices.
"""

import csv
import json
import sys

import numpy
import yaml
from urdf_parser_py import urdf as urdf_parser

ENCODER_ELEMENT = "ballbar_encoder"


def shifted(x, y, z):
    matrix = numpy.eye(4)
    matrix[:3, 3] = [x, y, z]
    return matrix


def turned(axis, angle):
    """Rodrigues' formula, about a unit vector."""
    x, y, z = axis
    cross = numpy.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    matrix = numpy.eye(4)
    matrix[:3, :3] += numpy.sin(angle) * cross + (1 - numpy.cos(angle)) * cross @ cross
    return matrix


def about(letter, angle):
    return turned([letter == other for other in "xyz"], angle)


def link_matrix(x, y, z, alpha, beta, gamma):
    return shifted(x, y, z) @ about("z", alpha) @ about("y", beta) @ about("x", gamma)


def joint_matrix(is_prismatic, value):
    return shifted(0, 0, value) if is_prismatic else about("z", value)


def chain_pose(links, joints, q):
    """Links of six numbers, joints of (is prismatic, offset, scale)."""
    pose = numpy.eye(4)
    for i, link in enumerate(links):
        pose = pose @ link_matrix(*link)
        if i < len(joints):
            is_prismatic, offset, scale = joints[i]
            pose = pose @ joint_matrix(is_prismatic, offset + scale * q[i])
    return pose


def urdf(text, base=None, tip=None):
    robot = urdf_parser.URDF.from_xml_string(text.encode())
    # The library keeps nothing that it does not know: what is ours is read from the text itself.
    from lxml import etree

    encoders = {joint.get("name"): joint.find(ENCODER_ELEMENT) for joint in etree.fromstring(text.encode()).findall("joint")}
    base = base or robot.get_root()
    tip = tip or next(link.name for link in robot.links if link.name not in robot.child_map)
    names = robot.get_chain(base, tip, links=False)

    def pose(q):
        outputs = iter(q)
        matrix = numpy.eye(4)
        for joint in (robot.joint_map[name] for name in names):
            if joint.origin is not None:
                roll, pitch, yaw = joint.origin.rpy or [0, 0, 0]
                matrix = matrix @ shifted(*(joint.origin.xyz or [0, 0, 0])) @ about("z", yaw) @ about("y", pitch) @ about("x", roll)
            if joint.type == "fixed":
                continue
            encoder = encoders[joint.name]
            value = next(outputs)
            if encoder is not None:
                value = float(encoder.get("offset")) + float(encoder.get("scale")) * value
            axis = numpy.array(joint.axis or [1, 0, 0])
            axis = axis / numpy.linalg.norm(axis)
            matrix = matrix @ (shifted(*(axis * value)) if joint.type == "prismatic" else turned(axis, value))
        return matrix

    def encoder_limits(joint):
        if joint.type == "continuous":
            return None
        encoder = encoders[joint.name]
        offset, scale = (0, 1) if encoder is None else (float(encoder.get("offset")), float(encoder.get("scale")))
        return sorted([(joint.limit.lower - offset) / scale, (joint.limit.upper - offset) / scale])

    return pose, [encoder_limits(robot.joint_map[name]) for name in names if robot.joint_map[name].type != "fixed"]


def ros2(text):
    return urdf(yaml.safe_load(text)["/**"]["ros__parameters"]["robot_description"])


def data(robot):
    links = [[*link["translation_m"], link["alpha_rad"], link["beta_rad"], link["gamma_rad"]] for link in robot["links"]]
    joints = [(joint["type"] == "prismatic", joint["offset"], joint["scale"]) for joint in robot["joints"]]
    return lambda q: chain_pose(links, joints, q), [[joint["min"], joint["max"]] for joint in robot["joints"]]


def parameters(text):
    rows = list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))
    to_si = {"mm": lambda value: value / 1e3, "deg": numpy.radians, "1": lambda value: value}
    values = {row["parameter"]: to_si[row["unit"]](float(row["value"])) for row in rows}
    units = {row["parameter"]: row["unit"] for row in rows}
    count = sum(name.startswith("scale") for name in values)
    letters = ["x", "y", "z", "alpha", "beta", "gamma"]
    links = [[values[f"{letter}{i}"] for letter in letters] for i in range(1, count + 2)]
    joints = [(units[f"offset{i}"] == "mm", values[f"offset{i}"], values[f"scale{i}"]) for i in range(1, count + 1)]
    limits = [[values[f"min{i}"], values[f"max{i}"]] for i in range(1, count + 1)]
    return lambda q: chain_pose(links, joints, q), limits


def denavit_hartenberg(text, is_modified):
    def ends(name):
        (line,) = [line for line in text.splitlines() if line.startswith(f"# {name}: ")]
        numbers = "".join(c if c in "0123456789.-+e" else " " for c in line.split(": ")[1].replace("deg", "").replace("Trans", ""))
        x, y, z, alpha, beta, gamma = [float(word) for word in numbers.split() if any(c.isdigit() for c in word)]
        return link_matrix(x / 1e3, y / 1e3, z / 1e3, *numpy.radians([alpha, beta, gamma]))

    base, tool = ends("base"), ends("tool")
    rows = list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))

    def pose(q):
        matrix = base
        for row, output in zip(rows, q, strict=True):
            theta, alpha = numpy.radians([float(row["theta_deg"]), float(row["alpha_deg"])])
            d, a = float(row["d_mm"]) / 1e3, float(row["a_mm"]) / 1e3
            if row["type"] == "prismatic":
                d += float(row["scale"]) * output
            else:
                theta += float(row["scale"]) * output
            about_z, about_x = about("z", theta) @ shifted(0, 0, d), shifted(a, 0, 0) @ about("x", alpha)
            matrix = matrix @ (about_x @ about_z if is_modified else about_z @ about_x)
        return matrix @ tool

    return pose, None


READERS = {
    "urdf": urdf,
    "ros2": ros2,
    "json": lambda text: data(json.loads(text)),
    "yaml": lambda text: data(yaml.safe_load(text)),
    "csv": parameters,
    "dh": lambda text: denavit_hartenberg(text, False),
    "mdh": lambda text: denavit_hartenberg(text, True),
}

form, path, joints_path, *ends = sys.argv[1:]
with open(path, encoding="utf-8", newline="") as file:
    pose_at, limits = READERS[form](file.read(), *ends)
with open(joints_path, encoding="utf-8") as file:
    print(json.dumps({"poses": [pose_at(q).tolist() for q in json.load(file)], "limits": limits}))
