"""Installs patches into the weights package."""

from __future__ import annotations

from pathlib import Path

from gear.dataset.files import write_alone
from gear.dataset.json_text import dump_json
from gear.networks.shipped import CHECKOUT
from gear.values.serial import Json

PATCHES = CHECKOUT / "patches"


def install(folder: Path, effect: Json, patches: Path = PATCHES) -> Path:
    """Copies the pictures and `attack.json` of a patch into the package, adds `effect.json`, and returns the folder.

    The patch's exact values are not copied, so that the package stays small; printed patches are pictures as well. An
    installed patch with the same name is replaced.
    """
    target = patches / folder.name
    target.mkdir(parents=True, exist_ok=True)
    for old in target.glob("patch_*.png"):
        old.unlink()
    for path in (*sorted(folder.glob("patch_*.png")), folder / "attack.json"):
        write_alone(target / path.name, path.read_bytes())
    write_alone(target / "effect.json", dump_json(effect))
    return target
