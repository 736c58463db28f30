"""Which files a town's pictures can show, and one hash over all of them."""

from __future__ import annotations

import hashlib
from pathlib import Path

from gear.values.resources import data_dir
from gear.world.assets import AssetLibrary

ASSET_SUFFIXES = (".xml", ".obj", ".msh", ".stl", ".png")


def asset_files(library: AssetLibrary) -> dict[str, Path]:
    """Every MJCF file, mesh and texture that goes with a town, by a name that does not say where it lies."""
    own = data_dir("mjcf")
    roots = [library.town, library.town.with_suffix("")]
    roots += [library.folder("vehicle"), library.folder("pedestrian"), library.folder("surface")]
    if any(root.is_relative_to(own) for root in roots):
        roots.append(own / "textures")
    files: dict[str, Path] = {}
    for root in roots:
        for path in root.rglob("*") if root.is_dir() else [root]:
            if path.suffix.lower() in ASSET_SUFFIXES and path.is_file():
                files[f"{root.name}/{path.relative_to(root).as_posix()}"] = path
    return files


def assets_digest(library: AssetLibrary) -> str:
    """sha256 over every MJCF file, mesh and texture that a town's pictures can show."""
    files = asset_files(library)
    digest = hashlib.sha256()
    for name in sorted(files):
        digest.update(f"{name}\0{hashlib.sha256(files[name].read_bytes()).hexdigest()}\n".encode())
    return digest.hexdigest()
