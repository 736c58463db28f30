"""The plugins that gear brings, by module. They come in by the same hooks as everybody else's."""

from __future__ import annotations

BUILTINS: tuple[str, ...] = (
    "gear.plugins.tasks.semseg",
    "gear.plugins.tasks.detect2d",
    "gear.plugins.tasks.stereo3d",
    "gear.plugins.tasks.depth",
    "gear.plugins.models.ddrnet23_slim",
    "gear.plugins.models.bisenet_x39",
    "gear.plugins.models.glpdepth",
    "gear.plugins.models.glpn_b0",
    "gear.plugins.models.adabins",
    "gear.plugins.models.ddrnet23_slim_depth",
    "gear.plugins.models.stereo_rcnn",
    "gear.plugins.models.stereo_centre",
    "gear.plugins.models.fasterrcnn_r50_fpn",
    "gear.plugins.models.retinanet_r50_fpn",
    "gear.plugins.models.retinanet_r18_fpn",
    "gear.plugins.defenses.lgs",
    "gear.plugins.defenses.jpeg",
    "gear.plugins.defenses.median",
    "gear.plugins.defenses.gaussian",
    "gear.plugins.defenses.bit_depth",
    "gear.plugins.attacks.scene_specific",
    "gear.plugins.attacks.carla_gear",
    "gear.plugins.attacks.eot",
    "gear.plugins.attacks.nes",
    "gear.plugins.attacks.square",
    "gear.plugins.attacks.rp2",
    "gear.plugins.attacks.thys",
    "gear.plugins.attacks.control",
)
