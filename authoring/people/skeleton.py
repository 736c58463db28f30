"""Bones: proportions of a person, a pose by angles, and the frames that follow from both.

Figure frame: x forward, y left, z up. A limb's bone points along its own -z, its x is the front of the limb.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from authoring.people.field import Array, Frame

SIDES = ("left", "right")


@dataclass(frozen=True, slots=True, kw_only=True)
class Build:
    """The proportions of a body: lengths as shares of the height, girths as factors on those of a slim adult.

    Attributes:
        height_m: standing height without shoes.
        head: factor on the size of the head; 1 is 1/7.6 of 1.76 m for people of any height.
        shoulders, chest, waist, hips, limbs: factors on widths.
        belly_m, bust_m: how far belly and bust project, metres.
        leg: factor on the share of the legs in the height.
        stoop_deg: forward lean of the upper back, degrees.
        female: whether hips, neck and face are those of a woman.
    """

    height_m: float
    head: float = 1.0
    shoulders: float = 1.0
    chest: float = 1.0
    waist: float = 1.0
    hips: float = 1.0
    limbs: float = 1.0
    belly_m: float = 0.0
    bust_m: float = 0.0
    leg: float = 1.0
    stoop_deg: float = 0.0
    female: bool = False

    @property
    def scale(self) -> float:
        """The height divided by 1.76 m, the height of the adult to whom the lengths in the code refer."""
        return self.height_m / 1.76


@dataclass(frozen=True, slots=True, kw_only=True)
class Arm:
    """Angles of one arm in degrees; flexion is forwards, `turn` swings a bent forearm inwards."""

    flex: float = 4.0
    abduct: float = 9.0
    turn: float = 12.0
    elbow: float = 14.0
    wrist: float = 4.0
    roll: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Leg:
    """Angles of one leg in degrees; `foot` is the sole's pitch over the ground, positive with the toes up."""

    flex: float = 0.0
    abduct: float = 3.0
    knee: float = 3.0
    foot: float = 0.0
    toe_out: float = 7.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Pose:
    """A pose of the whole body; angles are in degrees.

    Attributes:
        name: name of the files.
        kind: `walk` or `stand`.
        lean, twist: lean and twist of the chest relative to the pelvis.
        pelvis: forward lean of the pelvis.
        head_pitch, head_yaw: turn of the head downwards and to the left.
        grounded: whether both feet stand on the ground.
        telephone: whether the right hand holds a telephone.
        arms, legs: angles by side.
    """

    name: str
    kind: str
    lean: float = 0.0
    twist: float = 0.0
    pelvis: float = 0.0
    grounded: bool = True
    telephone: bool = False
    head_pitch: float = 0.0
    head_yaw: float = 0.0
    arms: dict[str, Arm] = field(default_factory=lambda: {side: Arm() for side in SIDES})
    legs: dict[str, Leg] = field(default_factory=lambda: {side: Leg() for side in SIDES})


@dataclass(frozen=True, slots=True, eq=False)
class Skeleton:
    """Frames by name: pelvis, chest, neck, head, and upper_arm, forearm, hand, thigh, shin, foot, toes of each side."""

    build: Build
    frames: dict[str, Frame]

    def __getitem__(self, name: str) -> Frame:
        return self.frames[name]


def turn_x(degrees: float) -> Array:
    """Rotation about x: y to z."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def turn_y(degrees: float) -> Array:
    """Rotation about y: z to x; leans a trunk forward, swings a leg back."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def turn_z(degrees: float) -> Array:
    """Rotation about z: x to y, to the left."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


THIGH_M, SHIN_M, ANKLE_M, BALL_M = 0.428, 0.432, 0.082, 0.128
UPPER_ARM_M, FOREARM_M = 0.298, 0.252


def leg_lengths(build: Build) -> tuple[float, float]:
    """Returns the lengths of thigh and shin, metres."""
    return THIGH_M * build.scale * build.leg, SHIN_M * build.scale * build.leg


def pose_skeleton(build: Build, pose: Pose) -> Skeleton:
    """Places every bone; the centre of the pelvis is at the origin, and the figure is moved onto the ground
    afterwards.
    """
    s = build.scale
    frames: dict[str, Frame] = {"pelvis": Frame(np.zeros(3), turn_y(pose.pelvis))}
    pelvis = frames["pelvis"]
    chest = pelvis.child((0.0, 0.0, 0.16 * s), turn_z(pose.twist) @ turn_y(pose.lean + build.stoop_deg))
    frames["chest"] = chest
    frames["neck"] = chest.child((-0.012 * s, 0.0, 0.385 * s), turn_y(14.0 + 0.4 * build.stoop_deg))
    upright = turn_z(pose.twist + pose.head_yaw) @ turn_y(pose.head_pitch + 0.25 * build.stoop_deg)
    skull = frames["neck"].at(0.0, 0.0, (0.068 if build.female else 0.076) * s + 0.012)
    frames["head"] = Frame(skull + upright @ np.array([0.022, 0.0, 0.078 * build.head]), upright)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        frames |= _arm(side, sign, chest, build, pose.arms[side])
        frames |= _leg(side, sign, pelvis, build, pose.legs[side])
    return Skeleton(build, frames)


def _arm(side: str, sign: float, chest: Frame, build: Build, arm: Arm) -> dict[str, Frame]:
    s = build.scale
    turn = turn_x(sign * arm.abduct) @ turn_y(-arm.flex) @ turn_z(-sign * arm.turn)
    upper = chest.child((-0.012 * s, sign * 0.166 * s * build.shoulders, 0.300 * s), turn)
    fore = upper.child((0.0, 0.0, -UPPER_ARM_M * s), turn_y(-arm.elbow))
    hand = fore.child((0.0, 0.0, -FOREARM_M * s), turn_z(-sign * arm.roll) @ turn_y(-arm.wrist))
    return {f"upper_arm_{side}": upper, f"forearm_{side}": fore, f"hand_{side}": hand}


def _leg(side: str, sign: float, pelvis: Frame, build: Build, leg: Leg) -> dict[str, Frame]:
    thigh_m, shin_m = leg_lengths(build)
    turn = turn_x(sign * leg.abduct) @ turn_z(sign * leg.toe_out) @ turn_y(-leg.flex)
    thigh = pelvis.child((0.0, sign * 0.088 * build.scale * (0.5 + 0.5 * build.hips), 0.0), turn)
    shin = thigh.child((0.0, 0.0, -thigh_m), turn_y(leg.knee))
    ankle = shin.at(0.0, 0.0, -shin_m)
    forward = shin.figure_from_local[:, 0]
    level = turn_z(float(np.degrees(np.arctan2(forward[1], forward[0]))))
    foot = Frame(ankle, level @ turn_y(-leg.foot))
    ball = foot.at(BALL_M * build.scale, 0.0, -ANKLE_M * build.scale)
    toes = Frame(ball, level if leg.foot < 0.0 else foot.figure_from_local)
    return {f"thigh_{side}": thigh, f"shin_{side}": shin, f"foot_{side}": foot, f"toes_{side}": toes}
