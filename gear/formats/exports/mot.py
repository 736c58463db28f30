"""Export to the layout of the MOTChallenge: sequences with pictures, tracks (`gt.txt`) and `seqinfo.ini`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from gear.contracts.tasks import Sidecar
from gear.formats.driving.tracks import MOT_CLASSES, mot_line, mot_sequence_info
from gear.formats.exports.layout import ExportSplit, Layout, Read, Tree
from gear.formats.exports.sequences import driving_splits, explained_content, pictures_of, sequences_of
from gear.values.frames import STATIC_OBJECT_BASE
from gear.values.serial import Json

BENCHMARK = "gear"
"""Name of the benchmark, the first part of the names of its folders: `gear-video`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MotOptions:
    """Options of the export to the MOTChallenge's layout.

    Attributes:
        boxes: `amodal` for boxes of whole silhouettes, with hidden parts and parts outside the picture, as in the
            MOTChallenge; `visible` for boxes of visible pixels, as in COCO.
    """

    boxes: Literal["amodal", "visible"] = "amodal"


@explained_content
def mot_tree(splits: Sequence[ExportSplit], read: Read, options: MotOptions) -> Tree:
    """The files of the driving sequences of a detect2d dataset in the layout of the MOTChallenge.

    A sequence has `gear-<split>/gear-<sequence>/img1/%06d.png`, `gt/gt.txt` and `seqinfo.ini`; frames count from 1.
    `seqmaps/gear-<split>.txt` lists the sequences of a split. The tracks are those of all road users. An object of
    which too little is visible is marked as not evaluated. A rider and the rider's vehicle are two tracks.

    Args:
        splits: the finished splits of the dataset.
        read: function that returns the bytes of a file of the dataset, by path relative to its root.
        options: options of this layout.

    Raises:
        DatasetError: the dataset has no driving sequence.
    """
    for split in driving_splits(splits, "mot"):
        pool, names = f"{BENCHMARK}-{split.info.split}", list[str]()
        for sequence in sequences_of(split):
            names.append(f"{BENCHMARK}-{len(names) + 1:02d}")
            for path, data in _sequence(split, sequence, names[-1], read, options):
                yield f"{pool}/{names[-1]}/{path}", data
        yield f"seqmaps/{pool}.txt", "".join(f"{line}\n" for line in ("name", *names)).encode()


def _sequence(
    split: ExportSplit, sequence: Sequence[Sidecar], name: str, read: Read, options: MotOptions
) -> Iterator[tuple[str, bytes]]:
    """The files of one sequence, by path relative to its folder."""
    lines: list[str] = []
    for sidecar in sequence:
        record = sidecar.record
        yield f"img1/{record.frame + 1:06d}.png", read(pictures_of(split, record)["left"])
        for thing in sidecar.facts["objects"]:
            if thing["object_id"] < STATIC_OBJECT_BASE and thing["label"] in MOT_CLASSES:
                lines.append(_line(sidecar, thing, options))
    camera = sequence[0].record.cameras[0]
    interval_s = sequence[1].record.time_s - sequence[0].record.time_s
    yield "gt/gt.txt", "".join(f"{line}\n" for line in lines).encode()
    yield "seqinfo.ini", mot_sequence_info(name, len(sequence), interval_s, (camera.width_px, camera.height_px))


def _line(sidecar: Sidecar, thing: Json, options: MotOptions) -> str:
    left, top, right, bottom = thing["amodal_box_px" if options.boxes == "amodal" else "box_px"]
    return mot_line(
        sidecar.record.frame,
        _track(sidecar, thing),
        (left, top, right, bottom),
        MOT_CLASSES[thing["label"]],
        thing["visible_fraction"],
        is_evaluated=not thing["is_ignored"],
    )


def _track(sidecar: Sidecar, thing: Json) -> int:
    """The track id of an object: its id; for people on or in a vehicle plus `STATIC_OBJECT_BASE`, so that they differ
    from the vehicle.
    """
    identity = int(thing["object_id"])
    is_on_vehicle = thing["label"] in ("person", "rider") and sidecar.record.actor(identity).role != "pedestrian"
    return identity + STATIC_OBJECT_BASE if is_on_vehicle else identity


LAYOUT = Layout(
    tasks=("detect2d",),
    summary="MOTChallenge: <sequence>/{img1,gt/gt.txt,seqinfo.ini}, seqmaps/; of driving sequences",
    tree=mot_tree,
    options=MotOptions,
)
