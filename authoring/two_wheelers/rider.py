"""Riders: people of `authoring.people` seated, hands on the grips and feet on the pegs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from authoring.people.body import torso
from authoring.people.field import Array, Frame, below, blend, cut, ellipsoid, loft, rounded_box
from authoring.people.figure import Figure, Person, meshes_of, pieces_of
from authoring.people.key_points import coco_key_points
from authoring.people.piece import Piece, mesh_pieces
from authoring.people.skeleton import (
    ANKLE_M,
    BALL_M,
    FOREARM_M,
    SIDES,
    UPPER_ARM_M,
    Pose,
    Skeleton,
    leg_lengths,
    pose_skeleton,
    turn_y,
)
from authoring.people.tailoring import collar_ring, neckline, sleeved

_PALM_M = 0.075


@dataclass(frozen=True, slots=True, kw_only=True)
class Seat:
    """Where a rider sits, metres in the machine's frame.

    Attributes:
        hips: middle between the hip joints.
        grip, foot: middle of the left grip, and where the ball of each foot rests, by side.
        lean_deg, pelvis_deg: how far chest and pelvis lean forward.
        sole_deg: pitch of the soles, positive with the toes up.
        knees_out: how far the knees point sideways, 0..1.
    """

    hips: tuple[float, float, float]
    grip: tuple[float, float, float]
    foot: dict[str, tuple[float, float, float]]
    lean_deg: float
    pelvis_deg: float = 0.0
    sole_deg: float = 0.0
    knees_out: float = 0.15
    head_pitch_deg: float = 0.0


def seated_skeleton(person: Person, seat: Seat) -> Skeleton:
    """The skeleton with its hips at the origin, limbs solved to reach grips and pegs."""
    pose = Pose(name="ride", kind="stand", lean=seat.lean_deg, pelvis=seat.pelvis_deg, head_pitch=seat.head_pitch_deg)
    build = person.build
    frames = dict(pose_skeleton(build, pose).frames)
    hips = np.array(seat.hips)
    s = build.scale
    for side, sign in (("left", 1.0), ("right", -1.0)):
        grip = np.array(seat.grip) * (1.0, sign, 1.0) - hips
        shoulder = frames[f"upper_arm_{side}"].origin
        reach = grip - shoulder
        wrist = grip - _PALM_M * s * reach / np.linalg.norm(reach) + np.array([0.0, 0.0, 0.012])
        elbow_side = np.array([-0.2, 0.75 * sign, -0.8])
        elbow, wrist = _bend(shoulder, wrist, UPPER_ARM_M * s, FOREARM_M * s, elbow_side)
        front = np.array([0.5, -0.3 * sign, 0.6])
        frames[f"upper_arm_{side}"] = _bone(shoulder, elbow, front)
        frames[f"forearm_{side}"] = _bone(elbow, wrist, front)
        frames[f"hand_{side}"] = _bone(wrist, grip + np.array([0.02, 0.0, -0.035]), np.array([0.2, -sign, 0.5]))
        sole = turn_y(-seat.sole_deg)
        ball = np.array(seat.foot[side]) - hips
        ankle = ball - sole @ np.array([BALL_M * s, 0.0, -ANKLE_M * s])
        thigh_m, shin_m = leg_lengths(build)
        hip = frames[f"thigh_{side}"].origin
        knee, ankle = _bend(hip, ankle, thigh_m, shin_m, np.array([1.0, seat.knees_out * sign, 0.6]))
        front = np.array([0.6, 0.0, 0.8])
        frames[f"thigh_{side}"] = _bone(hip, knee, front)
        frames[f"shin_{side}"] = _bone(knee, ankle, front)
        frames[f"foot_{side}"] = Frame(ankle, sole)
        frames[f"toes_{side}"] = Frame(ankle + sole @ np.array([BALL_M * s, 0.0, -ANKLE_M * s]), sole)
    return Skeleton(build, frames)


def _bend(root: Array, end: Array, upper: float, lower: float, towards: Array) -> tuple[Array, Array]:
    """Where the middle joint of a two-bone limb is, bent `towards`; an end out of reach is pulled in."""
    reach = end - root
    length = float(np.linalg.norm(reach))
    direction = reach / length
    length = min(length, 0.995 * (upper + lower))
    along = (upper**2 - lower**2 + length**2) / (2.0 * length)
    out = towards - direction * (towards @ direction)
    out /= np.linalg.norm(out)
    return root + along * direction + np.sqrt(max(upper**2 - along**2, 0.0)) * out, root + length * direction


def _bone(start: Array, end: Array, front: Array) -> Frame:
    z = (start - end) / np.linalg.norm(start - end)
    x = front - z * (front @ z)
    x /= np.linalg.norm(x)
    return Frame(start, np.stack([x, np.cross(z, x), z], axis=1))


def model_rider(person: Person, seat: Seat) -> Figure:
    """The rider in the machine's frame."""
    skeleton = seated_skeleton(person, seat)
    meshes = meshes_of(mesh_pieces(pieces_of(person, skeleton)), person, skeleton)
    return Figure(meshes=meshes, key_points=coco_key_points(skeleton)).translated(*seat.hips)


def riding_jacket(skeleton: Skeleton) -> list[Piece]:
    """A zipped jacket that ends at the belt."""
    body = torso(skeleton, ease=(0.026, 0.030, 0.026, 0.020), low=-0.03)
    body = cut(body, below(skeleton["pelvis"], 0.01 * skeleton.build.scale))
    body = sleeved(skeleton, body, ease=(0.020, 0.022, 0.018), sleeve=0.98, folds=True)
    body = cut(body, neckline(skeleton, deep_m=0.0, wide_m=0.062))
    collar = collar_ring(skeleton, radius_m=0.070, height_m=0.045, open_m=0.0)
    return [
        Piece(group="paint", field=body, faces=1000, cell_m=0.013, tint="paint"),
        Piece(group="paint", field=collar, faces=130, cell_m=0.008, tint="paint"),
    ]


def full_helmet(skeleton: Skeleton) -> list[Piece]:
    """A full-face helmet with a dark visor."""
    head = skeleton["head"]
    shell = blend(
        [
            ellipsoid(head, (-0.010, 0.0, 0.032), (0.138, 0.122, 0.122)),
            loft(
                head,
                [(-0.125, 0.028, 0.0, 0.100, 0.092), (-0.04, 0.025, 0.0, 0.122, 0.110)],
                cap=(0.006, 0.02),
                power=2.3,
            ),
        ],
        0.03,
    )
    window = rounded_box(head, (0.13, 0.0, 0.012), (0.075, 0.115, 0.040), 0.03)
    visor = ellipsoid(head, (-0.004, 0.0, 0.016), (0.136, 0.117, 0.105))
    return [
        Piece(group="extra", field=cut(shell, window, 0.008), faces=520, cell_m=0.0095, tint="helmet"),
        Piece(group="extra", field=visor, faces=160, cell_m=0.014, tint="visor"),
    ]


def open_helmet(skeleton: Skeleton) -> list[Piece]:
    """An open-face helmet with a short peak."""
    head = skeleton["head"]
    shell = ellipsoid(head, (-0.014, 0.0, 0.036), (0.134, 0.116, 0.118))
    shell = cut(shell, rounded_box(head, (0.13, 0.0, -0.07), (0.12, 0.2, 0.125), 0.03), 0.01)
    shell = cut(shell, below(head, -0.062), 0.01)
    peak = ellipsoid(head, (0.105, 0.0, 0.062), (0.062, 0.075, 0.010))
    return [Piece(group="extra", field=blend([shell, peak], 0.01), faces=460, cell_m=0.0095, tint="helmet")]


def cycle_helmet(skeleton: Skeleton) -> list[Piece]:
    """A vented cycling helmet."""
    head = skeleton["head"]
    shell = ellipsoid(head, (-0.012, 0.0, 0.052), (0.140, 0.100, 0.100))
    shell = cut(shell, below(head, 0.045, slope=(0.14, 0.0)), 0.012)
    for y in (-0.052, 0.0, 0.052):
        for x in (0.045, -0.055):
            shell = cut(shell, rounded_box(head, (x, y, 0.15), (0.034, 0.011, 0.035), 0.010), 0.008)
    strap = [rounded_box(head, (0.012, side * 0.080, -0.03), (0.008, 0.004, 0.075), 0.003) for side in (1.0, -1.0)]
    return [
        Piece(group="extra", field=shell, faces=520, cell_m=0.0085, tint="helmet"),
        *[Piece(group="extra", field=field, faces=30, cell_m=0.006, tint="black") for field in strap],
    ]


__all__ = [
    "SIDES",
    "Seat",
    "cycle_helmet",
    "full_helmet",
    "model_rider",
    "open_helmet",
    "riding_jacket",
    "seated_skeleton",
]
