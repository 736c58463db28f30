"""The poses of people on foot."""

from __future__ import annotations

from authoring.people.skeleton import Arm, Leg, Pose

STAND = Pose(
    name="stand",
    kind="stand",
    arms={"left": Arm(), "right": Arm(flex=2.0, elbow=17.0, abduct=10.0)},
    legs={"left": Leg(flex=2.0, abduct=5.0, knee=4.0), "right": Leg(flex=-1.0, abduct=4.0, knee=1.0, toe_out=11.0)},
)
_FRONT = Leg(flex=25.0, abduct=1.5, knee=6.0, foot=16.0)
_REAR = Leg(flex=-17.0, abduct=1.5, knee=20.0, foot=-30.0)
_SWING_FRONT = Arm(flex=22.0, abduct=8.0, elbow=26.0)
_SWING_REAR = Arm(flex=-24.0, abduct=10.0, elbow=12.0)


def _stride(name: str, *, left_first: bool, lean: float = 3.0, head_pitch: float = 3.0) -> Pose:
    front, rear = ("left", "right") if left_first else ("right", "left")
    return Pose(
        name=name,
        kind="walk",
        lean=lean,
        twist=-7.0 if left_first else 7.0,
        head_pitch=head_pitch,
        arms={rear: _SWING_FRONT, front: _SWING_REAR},
        legs={front: _FRONT, rear: _REAR},
    )


WALK_A = _stride("walk_a", left_first=True)
WALK_B = _stride("walk_b", left_first=False)
WALK_C = Pose(
    name="walk_c",
    grounded=False,
    kind="walk",
    lean=2.5,
    arms={"left": Arm(flex=-3.0, elbow=16.0), "right": Arm(flex=6.0, elbow=18.0)},
    legs={"left": Leg(flex=3.0, abduct=0.5, knee=4.0), "right": Leg(flex=22.0, abduct=1.0, knee=58.0, foot=-18.0)},
)
PHONE = Pose(
    name="phone",
    telephone=True,
    kind="stand",
    lean=3.0,
    head_pitch=24.0,
    head_yaw=8.0,
    arms={"left": Arm(flex=3.0, elbow=16.0), "right": Arm(flex=26.0, abduct=4.0, turn=32.0, elbow=98.0, roll=60.0)},
    legs=STAND.legs,
)
TALK = Pose(
    name="talk",
    kind="stand",
    head_yaw=14.0,
    twist=5.0,
    arms={
        "left": Arm(flex=22.0, abduct=14.0, turn=20.0, elbow=74.0, roll=55.0),
        "right": Arm(flex=12.0, abduct=14.0, turn=30.0, elbow=52.0, roll=40.0),
    },
    legs={"left": Leg(flex=4.0, abduct=6.0, knee=8.0, toe_out=14.0), "right": Leg(flex=-1.0, abduct=4.0, knee=1.0)},
)
CALL = Pose(
    name="call",
    telephone=True,
    kind="walk",
    lean=2.0,
    head_yaw=6.0,
    arms={"right": Arm(flex=71.0, abduct=14.0, turn=4.0, elbow=144.0, wrist=0.0), "left": _SWING_REAR},
    legs={"left": _FRONT, "right": _REAR},
)


def _shuffle(name: str, *, left_first: bool) -> Pose:
    front, rear = ("left", "right") if left_first else ("right", "left")
    return Pose(
        name=name,
        kind="walk",
        lean=4.0,
        twist=-3.0 if left_first else 3.0,
        head_pitch=8.0,
        arms={rear: Arm(flex=12.0, elbow=30.0), front: Arm(flex=-10.0, elbow=20.0)},
        legs={front: Leg(flex=17.0, knee=9.0, foot=8.0), rear: Leg(flex=-9.0, knee=16.0, foot=-18.0)},
    )


OLD_WALK_A = _shuffle("walk_a", left_first=True)
OLD_WALK_B = _shuffle("walk_b", left_first=False)
