"""A MJCF file as MuJoCo itself reads it."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco

from gear.world.assets import read_xml


def read_spec(path: Path) -> mujoco.MjSpec:
    """Reads a file that may have any name: MuJoCo alone takes none for MJCF whose name does not end in `.xml`.

    Raises:
        ValueError: MuJoCo refuses it.
        TownError: it is no XML, or cannot be read.
    """
    if path.suffix == ".xml":
        return mujoco.MjSpec.from_file(str(path))
    root = read_xml(path)
    for include in root.iter("include"):
        include.set("file", str(path.parent.absolute() / include.get("file", "")))
    spec = mujoco.MjSpec.from_string(ET.tostring(root, encoding="unicode"))
    spec.modelfiledir = str(path.parent.absolute())
    return spec
