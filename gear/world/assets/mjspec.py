"""Reads MJCF files with MuJoCo's own parser."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco

from gear.world.assets.library import read_xml


def read_spec(path: Path) -> mujoco.MjSpec:
    """Reads an MJCF file with any suffix as a spec; MuJoCo's own function accepts only `.xml`.

    Args:
        path: path of the file.

    Returns:
        The spec, which also accepts flat plates as bodies (`accept_flat_bodies`).

    Raises:
        ValueError: MuJoCo rejects the content.
        TownError: the file is not XML, or cannot be read.
    """
    if path.suffix == ".xml":
        spec = mujoco.MjSpec.from_file(str(path))
    else:
        root = read_xml(path)
        for include in root.iter("include"):
            include.set("file", str(path.parent.absolute() / include.get("file", "")))
        spec = mujoco.MjSpec.from_string(ET.tostring(root, encoding="unicode"))
        spec.modelfiledir = str(path.parent.absolute())
    accept_flat_bodies(spec)
    return spec


def accept_flat_bodies(spec: mujoco.MjSpec) -> None:
    """Changes a spec so that MuJoCo accepts a flat plate as a body of its own.

    The inertia of a plate is exactly at the limit that MuJoCo accepts, so rounding errors could make it invalid.

    Args:
        spec: the spec, changed in place.
    """
    spec.compiler.balanceinertia = True
