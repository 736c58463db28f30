"""A small study of `gear drive` for the tests of its page: the tiny town, no cameras, and videos written by hand."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np

import gear
from gear.dataset.sealed_json import load_sealed, sealed_json
from gear.driving.video import encoded
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN

TEXT = f"""
drivers: {{truth: {{controller: truth}}, blind: {{controller: blind}}}}
towns: {{"{TINY_TOWN}": [board]}}
scenarios: {{stopped_lead: [40]}}
collect: {{scenes: "{TINY_SCENES}"}}
"""


def make_study(root: Path) -> Path:
    """The study: two drivers, of which the blind one also has a twin with the patch, and a video of six frames."""
    root.mkdir(parents=True)
    (root / "tiny.yml").write_text(TEXT)
    gear.drive(root / "tiny.yml", out=root / "out")
    plain = next((root / "out/drives/blind").iterdir())
    patched = plain.with_name(plain.name.replace("-none-", "-patch-"))
    shutil.copytree(plain, patched)
    change_run(patched, twin="patch")
    levels = [np.full((60, 200, 3), 40 * number, np.uint8) for number in range(6)]
    (patched / "video.mp4").write_bytes(encoded(levels))
    return root / "out"


def change_run(folder: Path, **changes: Any) -> None:
    """Changes what a drive's result says about its run."""
    content = load_sealed(folder / "result.json")
    content["result"]["run"].update(changes)
    (folder / "result.json").write_bytes(sealed_json(content))


def change_frame(folder: Path, number: int, **changes: Any) -> None:
    """Changes entries of one line of a drive's log."""
    lines = (folder / "log.jsonl").read_text().splitlines()
    lines[number] = json.dumps(json.loads(lines[number]) | changes)
    (folder / "log.jsonl").write_text("\n".join(lines))
