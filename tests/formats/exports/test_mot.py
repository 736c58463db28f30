"""MOTChallenge: one track for each road user, and one for each rider."""

from __future__ import annotations

import configparser
from dataclasses import replace

from gear.formats.exports.mot import MotOptions, mot_tree
from gear.values.frames import STATIC_OBJECT_BASE
from gear.values.scene import ActorRecord, Pose, SceneRecord
from gear.values.serial import Json
from tests.formats.driving.drives import circle, split_with


def thing(object_id: int, label: str, *, is_ignored: bool = False) -> Json:
    return {
        "object_id": object_id, "label": label, "is_ignored": is_ignored, "box_px": [2.0, 3.0, 4.0, 5.0],
        "amodal_box_px": [-2.0, 3.0, 4.0, 8.5], "visible_fraction": 0.5,
    }  # fmt: skip


def with_actors(record: SceneRecord) -> SceneRecord:
    pose = Pose(position_m=(0.0, 0.0, 0.0))
    roles = {2: "npc", 3: "pedestrian"}
    others = tuple(
        ActorRecord(id=number, asset="x", role=role, world_from_actor=pose)  # type: ignore[arg-type]
        for number, role in roles.items()
    )
    return replace(record, actors=(*record.actors, *others))


FACTS = {
    "objects": [
        thing(2, "bicycle"), thing(2, "rider"), thing(3, "person", is_ignored=True),
        thing(STATIC_OBJECT_BASE + 1, "traffic_light"),
    ]
}  # fmt: skip


def test_tracks_frames_and_maps() -> None:
    records = [with_actors(record) for record in (*circle(3), *circle(2, sequence=1, start=3))]
    split = split_with(records, "detect2d", facts=[FACTS] * 5)
    files = dict(mot_tree([split], str.encode, MotOptions()))
    rows = [line.split(",") for line in files["gear-video/gear-02/gt/gt.txt"].decode().splitlines()]
    assert [(row[0], row[1], row[6], row[7]) for row in rows] == [
        (frame, *rest) for frame in ("1", "2") for rest in (("2", "1", "4"), ("1002", "1", "2"), ("3", "0", "1"))
    ], "a rider is a track of its own; lights are no road users"
    assert [float(field) for field in rows[0][2:6]] == [-1, 4, 6, 5.5]
    assert files["gear-video/gear-02/img1/000002.png"] == b"images/video/rgb_0004.png"
    assert files["seqmaps/gear-video.txt"] == b"name\ngear-01\ngear-02\n"
    info = configparser.ConfigParser()
    info.read_string(files["gear-video/gear-01/seqinfo.ini"].decode())
    assert info["Sequence"]["seqLength"] == "3" and info["Sequence"]["frameRate"] == "10"
    assert len(files) == 5 + 2 * 2 + 1


def test_boxes_of_visible_pixels_are_an_option() -> None:
    split = split_with([with_actors(record) for record in circle(2)], "detect2d", facts=[FACTS] * 2)
    files = dict(mot_tree([split], str.encode, MotOptions(boxes="visible")))
    row = files["gear-video/gear-01/gt/gt.txt"].decode().splitlines()[0].split(",")
    assert [float(field) for field in row[2:6]] == [3, 4, 2, 2]
