"""The 17 key points of COCO's people, from the joints of a skeleton and the features of its face.

COCO: Lin et al., "Microsoft COCO: Common Objects in Context", 2014; names and order as in its category `person`.
"""

from __future__ import annotations

from authoring.people.field import Array
from authoring.people.head import EAR, EYE, nose_tip
from authoring.people.skeleton import SIDES, Skeleton

JOINTS = {
    "shoulder": "upper_arm",
    "elbow": "forearm",
    "wrist": "hand",
    "hip": "thigh",
    "knee": "shin",
    "ankle": "foot",
}
"""The bone that begins at each joint, by the name of the joint."""

KeyPoints = dict[str, Array]
"""Positions, (3,) in metres, by the names of COCO and in COCO's order."""

_SIGNS = {"left": 1.0, "right": -1.0}


def coco_key_points(skeleton: Skeleton) -> KeyPoints:
    """The key points of a posed figure, in its frame: tip of the nose, middle of each eyeball and ear, and the joints.

    Args:
        skeleton: the posed skeleton.
    """
    head, k = skeleton["head"], skeleton.build.head
    points = {"nose": head.at(*(k * value for value in nose_tip(soft=skeleton.build.female)))}
    for name, (x, y, z) in (("eye", EYE), ("ear", EAR)):
        for side in SIDES:
            points[f"{side}_{name}"] = head.at(k * x, k * _SIGNS[side] * y, k * z)
    for joint, bone in JOINTS.items():
        for side in SIDES:
            points[f"{side}_{joint}"] = skeleton[f"{bone}_{side}"].origin
    return points


def key_point_lines(points: KeyPoints) -> str:
    """The elements of MJCF's `<custom>` section that list key points, to the millimetre.

    Args:
        points: positions in metres by name, in the frame of the actor.

    Returns:
        One line per point, each with its line break at the front.
    """
    lines = []
    for name, point in points.items():
        numbers = " ".join(f"{round(float(value), 3) + 0.0:g}" for value in point)  # + 0.0: no minus before a zero
        lines.append(f'\n    <numeric name="key_point.{name}" data="{numbers}"/>')
    return "".join(lines)
