"""Reads the lanes of a town from its MJCF file without compiling the town."""

from __future__ import annotations

from pathlib import Path

import mujoco

from gear.values.errors import TownError
from gear.world.assets.library import read_numbers
from gear.world.assets.mjspec import read_spec
from gear.world.roads.lanes import LaneGraph


def read_lanes(path: Path) -> LaneGraph:
    """Reads the graph of lanes, walks and parking bays from a town's MJCF file.

    Only the custom fields of the file are compiled, because compiling meshes would take seconds.

    Args:
        path: path of the town's MJCF file.

    Raises:
        TownError: the file is not XML, MuJoCo cannot read the file, or a lane is malformed.
    """
    read_numbers(path)
    try:
        whole, custom = read_spec(path), mujoco.MjSpec()
        for numeric in whole.numerics:
            custom.add_numeric(name=numeric.name, size=numeric.size, data=numeric.data)
        for text in whole.texts:
            custom.add_text(name=text.name, data=text.data)
        model = custom.compile()
    except ValueError as error:
        raise TownError(path, f"MuJoCo cannot read it: {' '.join(str(error).split())}") from error
    return LaneGraph.from_model(model, path)
