"""Croissant 1.1 metadata with the extension for responsible AI (RAI 1.0).

The metadata state what a dataset is, which files it has and how to read these files. Source:
https://docs.mlcommons.org/croissant/docs/croissant-spec-1.1.html.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from gear.formats.dataset_card import COLLECTION, LIMITS, USES, SplitFacts, title
from gear.values.serial import Json

CONTEXT: dict[str, Json] = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "arrayShape": "cr:arrayShape",
    "citeAs": "cr:citeAs",
    "column": "cr:column",
    "conformsTo": "dct:conformsTo",
    "containedIn": "cr:containedIn",
    "cr": "http://mlcommons.org/croissant/",
    "rai": "http://mlcommons.org/croissant/RAI/",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "dct": "http://purl.org/dc/terms/",
    "description": {"@container": "@language"},
    "equivalentProperty": "cr:equivalentProperty",
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "extract": "cr:extract",
    "field": "cr:field",
    "fileProperty": "cr:fileProperty",
    "fileObject": "cr:fileObject",
    "fileSet": "cr:fileSet",
    "format": "cr:format",
    "includes": "cr:includes",
    "isArray": "cr:isArray",
    "isLiveDataset": "cr:isLiveDataset",
    "jsonPath": "cr:jsonPath",
    "key": "cr:key",
    "md5": "cr:md5",
    "name": {"@container": "@language"},
    "parentField": "cr:parentField",
    "path": "cr:path",
    "recordSet": "cr:recordSet",
    "references": "cr:references",
    "regex": "cr:regex",
    "repeated": "cr:repeated",
    "replace": "cr:replace",
    "samplingRate": "cr:samplingRate",
    "sc": "https://schema.org/",
    "separator": "cr:separator",
    "source": "cr:source",
    "subField": "cr:subField",
    "transform": "cr:transform",
}
"""The JSON-LD context that the specification of Croissant prescribes."""

MEDIA_TYPES = {
    "png": "image/png",
    "tiff": "image/tiff",
    "jpg": "image/jpeg",
    "json": "application/json",
    "txt": "text/plain",
}

SHOWN = ("png", "jpg")
"""Suffixes of files that are described as pictures. TIFF is not among them, because mlcroissant interprets its numbers
as shares of white.
"""

ROLES = {"train": "cr:TrainingSplit", "val": "cr:ValidationSplit", "test": "cr:TestSplit"}
"""Croissant's name for the purpose of a split, by the first word of the split's name."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FilePattern:
    """The files of one kind, of which every sample has one.

    Attributes:
        name: name of the kind, such as `depth`.
        suffix: suffix of the files, without a dot.
        globs: glob patterns that find the files, relative to the dataset's root.
    """

    name: str
    suffix: str
    globs: Sequence[str]


def croissant(splits: Sequence[SplitFacts], patterns: Sequence[FilePattern], hashes: Mapping[str, str]) -> Json:
    """The JSON content of `croissant.json`, the Croissant metadata of a dataset.

    Args:
        splits: the finished splits of the dataset; at least one.
        patterns: the kinds of files that each sample has.
        hashes: SHA-256 of the files that several samples share, by path relative to the dataset's root.
    """
    first = splits[0]
    shared = [
        {
            "@type": "cr:FileObject",
            "@id": path,
            "name": path,
            "contentUrl": path,
            "encodingFormat": _media_type(path.rpartition(".")[2]),
            "sha256": digest,
        }
        for path, digest in sorted(hashes.items())
    ]
    sets = [
        {
            "@type": "cr:FileSet",
            "@id": pattern.name,
            "name": pattern.name,
            "encodingFormat": _media_type(pattern.suffix),
            "includes": list(pattern.globs),
        }
        for pattern in patterns
    ]
    pictures = [pattern for pattern in patterns if pattern.suffix in SHOWN]
    return {
        "@context": CONTEXT,
        "@type": "sc:Dataset",
        "conformsTo": ["http://mlcommons.org/croissant/1.1", "http://mlcommons.org/croissant/RAI/1.0"],
        "name": title(splits),
        "description": f"Driving scenes with exact ground truth for the task {first.task}, made by gear.",
        "license": "https://spdx.org/licenses/MIT.html",
        "creator": {"@type": "sc:Organization", "name": "gear", "description": "the program that made the dataset"},
        "datePublished": first.created,
        "dateCreated": first.created,
        "version": "1.0.0",
        "keywords": ["synthetic", "adversarial", "autonomous driving", first.task],
        "citeAs": "gear, and the paper CARLA-GeAR (2022); see CITATION.cff of gear",
        "isLiveDataset": False,
        **_responsible(splits),
        "distribution": [*shared, *sets],
        "recordSet": [_splits(splits), *(_pictures(pattern, splits) for pattern in pictures)],
    }


def _media_type(suffix: str) -> str:
    return MEDIA_TYPES.get(suffix, "application/octet-stream")


def _responsible(splits: Sequence[SplitFacts]) -> dict[str, Json]:
    """The fields of the extension for responsible AI."""
    made = sorted({f"gear {one.gear}, MuJoCo {one.mujoco}, renderer {one.renderer}" for one in splits})
    scenes = sorted({f"{one.town}/{one.scene}, weather {one.weather}, patch {one.patch}" for one in splits})
    return {
        "rai:dataCollection": f"{COLLECTION} Scenes: {'; '.join(scenes)}.",
        "rai:dataCollectionType": ["Software Collection", "Others"],
        "rai:dataAnnotationProtocol": "Labels are computed from the simulation's geometry; there are no annotators.",
        "rai:machineAnnotationTools": made,
        "rai:dataUseCases": [USES],
        "rai:dataLimitations": [LIMITS],
        "rai:dataBiases": ["Road users, streets and weather follow the configuration, and no real distribution."],
        "rai:personalSensitiveInformation": ["None: all people are generated."],
    }


def _splits(splits: Sequence[SplitFacts]) -> Json:
    """The record set of the splits, to which pictures refer."""
    data = []
    for one in splits:
        row = {"splits/name": one.name, "splits/samples": one.samples, "splits/seed": one.seed}
        role = ROLES.get(one.name.partition("_")[0])
        data.append({**row, "splits/url": role} if role else {**row, "splits/url": None})
    return {
        "@type": "cr:RecordSet",
        "@id": "splits",
        "name": "splits",
        "dataType": "cr:Split",
        "key": {"@id": "splits/name"},
        "field": [
            _field("splits/name", "sc:Text"),
            _field("splits/samples", "sc:Integer"),
            _field("splits/seed", "sc:Integer"),
            _field("splits/url", "sc:URL"),
        ],
        "data": data,
    }


def _field(name: str, kind: str, **further: Json) -> Json:
    return {"@type": "cr:Field", "@id": name, "name": name.rpartition("/")[2], "dataType": kind, **further}


def _pictures(pattern: FilePattern, splits: Sequence[SplitFacts]) -> Json:
    """The record set of the pictures of one kind: picture, name of the file, split."""
    name = f"{pattern.name}_pictures"
    files = {"@id": pattern.name}
    names = "|".join(re.escape(one.name) for one in splits)
    in_split = {"extract": {"fileProperty": "fullpath"}, "transform": {"regex": f"^(?:.*/)?({names})(?:/.*)?$"}}
    return {
        "@type": "cr:RecordSet",
        "@id": name,
        "name": name,
        "field": [
            _field(
                f"{name}/picture", "sc:ImageObject", source={"fileSet": files, "extract": {"fileProperty": "content"}}
            ),
            _field(f"{name}/file", "sc:Text", source={"fileSet": files, "extract": {"fileProperty": "filename"}}),
            _field(
                f"{name}/split",
                "sc:Text",
                source={"fileSet": files, **in_split},
                references={"field": {"@id": "splits/name"}},
            ),
        ],
    }
