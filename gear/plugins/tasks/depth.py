"""The task of monocular depth, with KITTI's 16-bit pictures and exact depth files in the folders of CARLA-GeAR."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from gear.augment.geometry import Geometry, Window, cut_map, cut_picture, flip_array
from gear.augment.registry import register
from gear.contracts.evaluation import Masks
from gear.contracts.hookspecs import hookimpl
from gear.contracts.legends import ColourBar, Legend
from gear.contracts.specs import TaskSpec
from gear.contracts.tasks import Encoded, Evaluator, Indexes, Sample, Sidecar, SplitInfo
from gear.formats import kitti_depth, results
from gear.formats.billboard_info import billboard_info
from gear.formats.jsontext import dump
from gear.formats.png import encode_labels, encode_rgb, encode_tiff
from gear.formats.png_rows import encode_deep
from gear.metrics.depth import Crop, DepthEvaluator, NearDepth
from gear.metrics.obstacle_depth import NEAREST_OBSTACLE, ObstacleDepth
from gear.plugins.tasks.common import (
    CameraOptions,
    draw_surfaces,
    images_of,
    read_map,
    read_plain,
    read_rgb,
    surfaces_of,
)
from gear.values.errors import FieldError
from gear.values.frames import FloatImage, Frame, UInt8Image
from gear.values.rig import Rig
from gear.values.scene import SceneRecord
from gear.values.serial import Json

VIEW = "left"
PREVIEW_DEPTHS_M = (2.0, 3.0, 5.0, 10.0, 20.0, 40.0, 80.0)
"""Depths in metres at the ticks of the preview's legend; nearer and farther depths have the colours of its ends."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthConfig(CameraOptions):
    """Options of monocular depth. They include the options of `CameraOptions`.

    Pictures have the size that loaders of KITTI depth crop them to, 1216 x 352. CARLA-GeAR's loader keeps the lowest
    352 rows and assumes the camera's axis in their middle, so it places patches correctly only in pictures of this
    size.

    Attributes:
        max_depth_m: pixels that are farther have no ground truth.
        eval_max_depth_m: pixels that are farther are not evaluated by the `eigen_` metrics; 80 m is customary.
        eval_crop: part of the picture that the `eigen_` metrics evaluate.
    """

    width_px: int = 1216
    height_px: int = 352
    max_depth_m: float = 1000.0
    eval_max_depth_m: float = 80.0
    eval_crop: Crop = "none"

    def __post_init__(self) -> None:
        CameraOptions.__post_init__(self)
        for name in ("max_depth_m", "eval_max_depth_m"):
            if not getattr(self, name) > 0:
                raise FieldError(name, f"must be above 0 m, got {getattr(self, name):g}")


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class DepthSample(Sample):
    """A sample of monocular depth: a picture with its depth map.

    Attributes:
        depth_m: (H, W) float32 depth along the camera's axis, metres; NaN for pixels without ground truth.
    """

    depth_m: FloatImage


def _paths(split: str, index: int) -> tuple[str, str, str]:
    """Paths of a sample's picture, of its 16-bit depth picture, and of its depth in metres."""
    name = f"{split}/rgb_{index:04d}"
    return f"leftImg8bit/{name}.png", f"gtFine/{name}.png", f"gtFine/{name}.tiff"


class DepthTask:
    """The task of monocular depth; it writes the folders `leftImg8bit`, `gtFine` and `filenames`.

    Args:
        config: options of the task.
    """

    def __init__(self, config: DepthConfig) -> None:
        self.config = config

    def rig(self) -> Rig:
        """The camera rig of the task: one camera, `left`."""
        return Rig(cameras=(self.config.mount(VIEW),), follows_road=self.config.follows_road)

    def ground_truth(self, frame: Frame, record: SceneRecord) -> DepthSample:
        """Makes a sample from a rendered frame; pixels deeper than `max_depth_m` get NaN.

        Args:
            frame: the rendered views of the scene, with depth.
            record: the scene.
        """
        depth_m = frame.views[VIEW].depth_m
        known = (depth_m > 0) & (depth_m <= self.config.max_depth_m)
        return DepthSample(
            record=record,
            images=images_of(frame),
            surfaces=surfaces_of(frame, record),
            depth_m=np.where(known, depth_m, np.float32(np.nan)),
        )

    def encode(self, sample: DepthSample, info: SplitInfo) -> Encoded:
        """Encodes the picture, the depth as KITTI's 16-bit picture, and the depth in metres as a float file.

        Args:
            sample: the sample with its ground truth.
            info: names of the split, town and scene, for paths.
        """
        image, units, metres = _paths(info.split, sample.record.index)
        known = np.isfinite(sample.depth_m)
        files = {
            image: encode_rgb(sample.images[VIEW]),
            units: encode_labels(kitti_depth.to_units(sample.depth_m)),
            metres: encode_tiff(kitti_depth.to_metres_file(sample.depth_m)),
        }
        return Encoded(files=files, facts={"known_px": int(known.sum())})

    def finalise(self, sidecars: Sequence[Sidecar], info: SplitInfo) -> Mapping[str, bytes]:
        """Makes the files of a whole split: the file lists, and the poses that CARLA-GeAR's loader reads.

        Args:
            sidecars: metadata of all samples of the split, in order.
            info: names of the split, town, scene and patch.
        """
        return self.extend({}, 0, sidecars, info)

    def extend(self, before: Indexes, start: int, sidecars: Sequence[Sidecar], info: SplitInfo) -> Indexes:
        """Makes the files of a whole split from those of its first samples; used when samples are added to a
        dataset.

        Args:
            before: contents of the split's files after the first `start` samples, by path; {} for none.
            start: number of samples that `before` contains.
            sidecars: metadata of all samples of the split, in order.
            info: names of the split, town, scene and patch.

        Returns:
            Contents of the files by path below the dataset's root.
        """
        place = f"gtFine/{info.split}/camera_billboard_info.json"
        records = (sidecars[index].record for index in range(start, len(sidecars)))
        poses = billboard_info(
            records, task="depth", patch_label=info.patch_label, reference=VIEW, before=before.get(place)
        )
        paths = [_paths(info.split, index) for index in range(len(sidecars))]
        return {
            # CARLA-GeAR's loader takes the file's numbers for metres, so its list names the float pictures.
            f"filenames/{info.split}_list.txt": kitti_depth.file_list([(image, metres) for image, _, metres in paths]),
            f"filenames/{info.split}_list_kitti.txt": kitti_depth.file_list(
                [(image, units) for image, units, _ in paths]
            ),
            place: dump(poses),
        }

    def decode(self, root: Path, sidecar: Sidecar, info: SplitInfo) -> DepthSample:
        """Reads a sample from its files: the picture and the depth in metres.

        Args:
            root: root folder of the dataset.
            sidecar: metadata of the sample.
            info: names of the split, town and scene, for paths.
        """
        image, _, metres = _paths(info.split, sidecar.record.index)
        return DepthSample(
            record=sidecar.record,
            images={VIEW: read_rgb(root, image, sidecar.record, VIEW)},
            surfaces=sidecar.surfaces,
            depth_m=kitti_depth.from_metres_file(read_map(root, metres, sidecar.record, VIEW, np.float32)),
        )

    def as_prediction(self, sample: DepthSample) -> FloatImage:
        """Returns the ground truth as a prediction: (H, W) float32 metres; unknown pixels get `max_depth_m`.

        Args:
            sample: the sample with its depth map.
        """
        return np.where(np.isfinite(sample.depth_m), sample.depth_m, np.float32(self.config.max_depth_m))

    def evaluator(self) -> Evaluator[DepthSample, FloatImage]:
        """A new evaluator with the metrics of KITTI's devkit and of Eigen et al."""
        return DepthEvaluator(max_depth_m=self.config.eval_max_depth_m, crop=self.config.eval_crop)

    def reports(self) -> Mapping[str, Evaluator[DepthSample, FloatImage]]:
        """Further evaluators by name: `reference` evaluates whole pictures below 80 m, without the sky;
        `nearest_obstacle` evaluates the pixels of the nearest road user in the ego lane.
        """
        return {"reference": NearDepth(), NEAREST_OBSTACLE: ObstacleDepth(VIEW)}

    def without(self, sample: DepthSample, masks: Masks) -> DepthSample:
        """Returns a copy of the sample without ground truth (NaN) at the pixels of the mask, so that no metric
        counts them.

        Args:
            sample: the sample with its depth map.
            masks: (H, W) bool by camera name.
        """
        return replace(sample, depth_m=np.where(masks[VIEW], np.float32(np.nan), sample.depth_m))

    def encode_prediction(self, sample: DepthSample, prediction: FloatImage, info: SplitInfo) -> Encoded:
        """Encodes a predicted depth map as the devkit's 16-bit picture and as a lossless file in metres.

        The 16-bit picture is clipped to 256 m.

        Args:
            sample: the sample, which gives the file names.
            prediction: (H, W) predicted depth in metres.
            info: names of the split, town and scene; not used.
        """
        units, metres = results.kitti_depth_paths(sample.record.index)
        depth_m = np.asarray(prediction, dtype=np.float32)
        return Encoded(
            files={units: encode_deep(kitti_depth.to_predicted_units(depth_m)), metres: encode_tiff(depth_m)}, facts={}
        )

    def decode_prediction(self, root: Path, sample: DepthSample, facts: Json, info: SplitInfo) -> FloatImage:
        """Reads a stored prediction: (H, W) float32 metres, from the lossless file.

        Args:
            root: folder of the stored predictions.
            sample: the sample, which gives the file name.
            facts: metadata stored with the prediction; not used.
            info: names of the split, town and scene; not used.
        """
        return read_plain(root, results.kitti_depth_paths(sample.record.index)[1])

    def finalise_predictions(self, facts: Sequence[tuple[SceneRecord, Json]], info: SplitInfo) -> Mapping[str, bytes]:
        """Returns no files, because the depth pictures of the samples are complete results.

        Args:
            facts: scene record and stored metadata of each sample.
            info: names of the split, town and scene.
        """
        return {}

    def preview(self, sample: DepthSample) -> Mapping[str, UInt8Image]:
        """Returns the pictures to look at: `image` with outlined surfaces, and `depth` in colours (near red, far
        blue, unknown black).

        Args:
            sample: the sample with its depth map.
        """
        picture = sample.images[VIEW].copy()
        draw_surfaces(picture, sample, VIEW)
        colours = depth_colours(sample.depth_m)
        colours[~np.isfinite(sample.depth_m)] = 0
        return {"image": picture, "depth": colours}

    def prediction_preview(self, sample: DepthSample, prediction: FloatImage) -> Mapping[str, UInt8Image]:
        """Returns the picture to look at, as `depth`: the predicted depth in the colours of the preview `depth`.

        Args:
            sample: the sample; not used.
            prediction: (H, W) predicted depth in metres.
        """
        return {"depth": depth_colours(prediction)}

    def legends(self) -> Mapping[str, Legend]:
        """The colour bar of the preview `depth`, with depths in metres."""
        nearness = np.linspace(1.0, _nearness(np.float64(PREVIEW_DEPTHS_M[-1])), 64)
        colours = depth_colours(PREVIEW_DEPTHS_M[0] / np.square(nearness)[None])[0]
        places = (1 - _nearness(np.array(PREVIEW_DEPTHS_M))) / (1 - nearness[-1])
        ticks = zip(places.tolist(), (f"{depth_m:g}" for depth_m in PREVIEW_DEPTHS_M), strict=True)
        return {
            "depth": ColourBar(
                quantity="depth (m), black: unknown",
                colours=tuple((int(r), int(g), int(b)) for r, g, b in colours),
                ticks=tuple(ticks),
            )
        }


def depth_colours(depth_m: npt.NDArray[np.floating[Any]]) -> UInt8Image:
    """Colours of depths, from red (2 m and nearer) to dark blue (80 m and farther, or unknown).

    Args:
        depth_m: (H, W) metres; NaN or infinity where the depth is unknown.

    Returns:
        (H, W, 3) uint8 RGB. The colour is linear in the square root of inverse depth, so near objects differ most.
    """
    levels = (_nearness(np.where(np.isfinite(depth_m), depth_m, PREVIEW_DEPTHS_M[-1])) * 255).astype(np.uint8)
    colours: UInt8Image = cv2.applyColorMap(levels, cv2.COLORMAP_TURBO)[..., ::-1].copy()
    return colours


def _nearness(depth_m: npt.NDArray[np.floating[Any]] | np.float64) -> Any:
    """1 at the nearest depth that has a colour of its own; decreases with the distance."""
    return np.sqrt(PREVIEW_DEPTHS_M[0] / np.clip(depth_m, PREVIEW_DEPTHS_M[0], PREVIEW_DEPTHS_M[-1]))


WHITE_FROM_M = 80.0
"""Depth in metres at which the grey of CutDepth reaches white."""


def flip(sample: DepthSample) -> DepthSample:
    """Returns a sample that is mirrored left to right: picture and depth map; surfaces are removed.

    Args:
        sample: the sample; it is not changed.
    """
    return replace(
        sample,
        images={name: flip_array(picture) for name, picture in sample.images.items()},
        surfaces=(),
        depth_m=flip_array(sample.depth_m),
    )


def cut(sample: DepthSample, window: Window) -> DepthSample:
    """Crops a sample to a window and resizes it, as if the focal length were unchanged; surfaces are removed.

    Depth is divided by the window's scale, because with the same focal length an object that appears `s` times as large
    is at 1/s of the distance. Depth is unknown (NaN) beyond the picture.

    Args:
        sample: the sample; it is not changed.
        window: the part to crop, and the size after resizing.
    """
    small = shrink(sample, window)
    return replace(small, depth_m=(small.depth_m / np.float32(window.scale)).astype(np.float32))


def shrink(sample: DepthSample, window: Window) -> DepthSample:
    """Crops a sample to a window and resizes it without changing its depth values; surfaces are removed.

    With the window of the whole picture, the result is that of a camera with the same field of view and fewer pixels.

    Args:
        sample: the sample; it is not changed.
        window: the part to crop, and the size after resizing.
    """
    return replace(
        sample,
        images={name: cut_picture(picture, window) for name, picture in sample.images.items()},
        surfaces=(),
        depth_m=cut_map(sample.depth_m, window, np.nan),
    )


def cut_depth(sample: DepthSample, rng: np.random.Generator) -> DepthSample:
    """Vertical CutDepth: replaces a random band of columns of the picture by its true depth as grey values.

    Kim et al., "Global-Local Path Networks for Monocular Depth Estimation with Vertical CutDepth", 2022, section 3.3:
    the band reaches from top to bottom, because depth changes most along columns. It takes at most three quarters of
    the width.

    Args:
        sample: the sample.
        rng: random generator of position and width.
    """
    width = sample.depth_m.shape[1]
    left = int(rng.integers(0, width))
    right = left + max(1, int((width - left) * 0.75 * rng.random()))
    images = {name: _with_band(picture, sample.depth_m, left, right) for name, picture in sample.images.items()}
    return replace(sample, images=images)


def _with_band(picture: UInt8Image, depth_m: FloatImage, left: int, right: int) -> UInt8Image:
    band_m = depth_m[:, left:right]
    grey = np.clip(np.where(np.isfinite(band_m), band_m, WHITE_FROM_M) / WHITE_FROM_M, 0, 1) * 255
    painted = picture.copy()
    painted[:, left:right] = np.rint(grey).astype(np.uint8)[..., None]
    return painted


register(DepthSample, Geometry(flip=flip, cut=cut, shrink=shrink, cut_depth=cut_depth))


depth: TaskSpec[DepthConfig] = TaskSpec(
    name="depth",
    summary="Monocular depth: 16-bit KITTI pictures, float TIFF in metres, both lists.",
    config=DepthConfig,
    build=DepthTask,
    views=(VIEW,),
    layout="leftImg8bit/<split>/rgb_%04d.png, gtFine/<split>/rgb_%04d.{png,tiff}, filenames/<split>_list{,_kitti}.txt",
    original_name="depth",
    metric="eigen_d1",
)


@hookimpl
def gear_tasks() -> list[TaskSpec[DepthConfig]]:
    """Hook of the plugin system: returns the task plugin that this module defines."""
    return [depth]
