"""Reads each MJCF file of a planned world once, before dm_control composes the world."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass

from gear.world.assets.scene_assets import AssetFile
from gear.world.compilation.asset_prefetch import AssetPrefetcher
from gear.world.compilation.static_parts import SplitAsset, SplitTown, split_asset, split_town
from gear.world.compilation.world_plan import WorldPlan


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneMjcf:
    """The MJCF of a town, its boards and its actors, split into parts for dm_control and parts that are copied as text.

    Attributes:
        town: the town's file.
        assets: the files of boards and actors.
    """

    town: SplitTown
    assets: Mapping[AssetFile, SplitAsset]


def read_scene_mjcf(plan: WorldPlan, prefetcher: AssetPrefetcher) -> SceneMjcf:
    """Reads the MJCF files of a planned world.

    Args:
        plan: the contents of the world.
        prefetcher: starts to read the meshes of a file as soon as that file is read.

    Raises:
        TownError: a file is not XML or cannot be read, or one of its meshes cannot be read.
    """
    town = split_town(plan.town)
    prefetcher.prefetch(map(os.fsdecode, town.mesh_paths.values()))
    assets: dict[AssetFile, SplitAsset] = {}
    for file in dict.fromkeys([*plan.assets.boards, *(AssetFile(slot.actor.path) for slot in plan.slots)]):
        assets[file] = split_asset(file)
        prefetcher.prefetch(map(os.fsdecode, assets[file].mesh_paths.values()))
    return SceneMjcf(town=town, assets=assets)
