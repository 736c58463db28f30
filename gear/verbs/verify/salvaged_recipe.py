"""Finds out how a split was made if both its plan and its manifest are damaged.

Both files record the recipe of the split. Their entries are read one by one, so that damage to one entry does not hide
the others. A wrong value is noticed: the plan that results must have the hash that the damaged files name.
"""

from __future__ import annotations

import contextlib
import json
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice, product
from pathlib import Path
from typing import Any

from gear.dataset.files import inside, read_bytes
from gear.dataset.json_text import parse_json
from gear.dataset.layout import manifest_path, plan_path
from gear.dataset.plan import Plan
from gear.dataset.sealed_json import DIGITS, END, LENGTH, TAIL, sealed_json
from gear.values.errors import DatasetError
from gear.values.serial import Json

ENTRY = re.compile(r'^ "([^"\n]+)": ', re.MULTILINE)
"""The start of an entry of the outermost object in a JSON file of gear, which is indented by one blank."""

MOST_CANDIDATES = 32
"""Largest number of combinations of values that are tried; there are several if the two files disagree."""

LEAST_EQUAL = 48
"""Smallest number of equal digits, of 64, that identifies a SHA-256 in which some digits may be damaged."""

MOST_SAMPLES = 1_000_000
"""Largest number of samples of a split, as in a collection config."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SalvagedRecipe:
    """What the damaged plan and manifest of a split still say.

    Attributes:
        candidates: combinations of the recorded values, the most probable first, with the keys `recipe`, `town`,
            `seed`, `patch`, `samples` and `frames`; none if a value is lost in both files.
        content_key: content key that the damaged manifest states; "" if it is lost.
        seal: SHA-256 that the damaged plan states of its own content, in which digits may be damaged; "" if the plan
            is missing.
    """

    candidates: tuple[dict[str, Json], ...]
    content_key: str
    seal: str

    def is_proven(self, plan: Plan) -> bool:
        """Whether the file of `plan` has the bytes that the damaged plan had; without a plan, whether the samples are
        the same, by the content key in the manifest.
        """
        if not self.seal:
            return plan.content_key == self.content_key
        pairs = zip(_seal_of(sealed_json(plan.as_json())), self.seal, strict=False)
        return sum(one == other for one, other in pairs) >= LEAST_EQUAL


def salvaged_recipe(root: Path, split: str, samples: int) -> SalvagedRecipe:
    """Reads what the damaged plan and manifest of a split still say.

    Args:
        root: root of the dataset.
        split: name of the split.
        samples: number of samples of which there are files, for the case that neither file says the number.
    """
    plan_data, manifest_data = (_bytes(root, name(split)) for name in (plan_path, manifest_path))
    plan, manifest = readable_entries(plan_data), readable_entries(manifest_data)
    merged = _merged(_texts(plan_data).get("recipe", ""), _texts(manifest_data).get("config", ""))
    content, info = _object(plan.get("content")), [_object(one.get("info")) for one in (plan, manifest)]
    listed = _list(manifest.get("samples"))
    frames = 1 + max((_int(_object(one).get("frame")) for one in listed), default=0)
    values: dict[str, Sequence[Json]] = {
        "recipe": [plan.get("recipe"), manifest.get("config"), *merged],
        "town": [content.get("town"), *(one.get("town") for one in info)],
        "seed": [content.get("seed"), manifest.get("seed"), *(one.get("seed") for one in info)],
        "patch": [plan.get("patch"), manifest.get("patch")],
        "samples": [plan.get("samples"), len(listed), samples],
        "frames": [content.get("frames"), frames],
    }
    found = [_by_votes(one for one in values[key] if _is_valid(key, one)) for key in values]
    return SalvagedRecipe(
        candidates=tuple(dict(zip(values, one, strict=True)) for one in islice(product(*found), MOST_CANDIDATES)),
        content_key=str(manifest.get("content_key", "")),
        seal=_seal_of(plan_data) if len(plan_data) >= LENGTH else "",
    )


def readable_entries(data: bytes) -> dict[str, Json]:
    """The entries of the outermost object in a damaged JSON file of gear that are still JSON.

    Args:
        data: content of the file, as gear writes JSON: one entry per line, indented by one blank.
    """
    found: dict[str, Json] = {}
    for key, text in _texts(data).items():
        with contextlib.suppress(ValueError, RecursionError):
            found[key] = parse_json(text)
    return found


def _texts(data: bytes) -> dict[str, str]:
    """The text of each entry of the outermost object, by key; it need not be JSON."""
    text = data.decode(errors="replace")
    starts = list(ENTRY.finditer(text))
    found: dict[str, str] = {}
    ends = [one.start() for one in starts[1:]] + [len(text)]
    for start, end in zip(starts, ends, strict=False):
        value = text[start.end() : end].rstrip()
        value = value.removesuffix(END.decode().strip()).rstrip() if end == len(text) else value.removesuffix(",")
        found[start[1]] = value
    return found


def _merged(one: str, other: str) -> Iterator[Json]:
    """The values that result if each line is taken from either of two damaged texts of the same JSON."""
    lines, others = one.split("\n"), other.split("\n")
    if len(lines) != len(others):
        return
    choices = [dict.fromkeys(pair) for pair in zip(lines, others, strict=True)]
    for chosen in islice(product(*choices), MOST_CANDIDATES):
        with contextlib.suppress(ValueError, RecursionError):
            yield parse_json("\n".join(chosen))


def _seal_of(data: bytes) -> str:
    """The SHA-256 that a JSON file states of its own content."""
    return data[-len(TAIL) - DIGITS : -len(TAIL)].decode(errors="replace")


KINDS = {"recipe": dict, "town": str, "seed": int}
"""Types of the values that have no further conditions."""


def _is_valid(key: str, value: Json) -> bool:
    """Whether a value can be that of the key, so that it can be tried."""
    if key == "patch":
        return isinstance(value, dict) and all(isinstance(value.get(name), str) for name in ("label", "sha256"))
    if key in ("samples", "frames"):
        return isinstance(value, int) and 1 <= value <= MOST_SAMPLES
    return isinstance(value, KINDS[key])


def _by_votes(values: Iterator[Json]) -> list[Json]:
    """The different values, those that are recorded most often first; the order of their keys is kept."""
    votes = Counter(json.dumps(value) for value in values)
    return [json.loads(text) for text, _ in votes.most_common()]


def _bytes(root: Path, relative: str) -> bytes:
    """The content of a file of the dataset; empty if it is missing or unreadable."""
    try:
        return read_bytes(inside(root, relative))
    except DatasetError:
        return b""


def _object(value: Json) -> dict[str, Any]:
    return value if isinstance(value, dict) else {}


def _list(value: Json) -> list[Any]:
    return value if isinstance(value, list) else []


def _int(value: Json) -> int:
    return value if isinstance(value, int) else 0
