import contextlib
import importlib
import io
import json
import math
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from PIL import Image

from gear.formats.cityscapes import LABELS, camera_json, city_name, colour_map, paths, stem
from gear.formats.cityscapes_polygons import polygons_json
from gear.values.geometry import RigidTransform
from gear.values.labels import LABELS as GEAR_LABELS
from gear.values.rig import CameraMount, Rig

official = importlib.import_module("cityscapesscripts.helpers.labels")


def test_the_table_is_the_official_one() -> None:
    for label in official.labels:
        if label.id < 0:
            continue
        ours = LABELS[label.id]
        assert (ours.name, ours.train_id, ours.category, ours.has_instances, ours.rgb) == (
            label.name, label.trainId, label.category, label.hasInstances, label.color)  # fmt: skip
        assert ours.is_evaluated is not label.ignoreInEval
    assert [label.id for label in LABELS] == list(range(34))


def test_gears_labels_agree_on_instances() -> None:
    for label in GEAR_LABELS:
        assert LABELS[label.cityscapes_id].has_instances is label.is_instance


@pytest.mark.parametrize("town", ["town10", "My_Town 2.xml", "Süd"])
def test_names_split_into_five_parts(town: str) -> None:
    from cityscapesscripts.helpers.csHelpers import getCsFileInfo

    name = paths(town, "val", 12, 3).label_ids.rsplit("/", 1)[1]
    info = getCsFileInfo(name)
    assert (info.city, info.sequenceNb, info.frameNb) == (city_name(town), "000012", "000003")
    # The original's loader cuts `leftImg8bit.png` off the names of three cities only.
    assert "aachen" in name
    assert stem(town, 12, 3) + "_leftImg8bit.png" == paths(town, "val", 12, 3).image.rsplit("/", 1)[1]


def test_colours_are_painted() -> None:
    ids = np.arange(34, dtype=np.uint8).reshape(2, 17)
    picture = colour_map(ids)
    assert picture.shape == (2, 17, 4)
    assert tuple(picture[0, 7]) == (128, 64, 128, 255)
    assert tuple(picture[1, 16]) == (119, 11, 32, 255)


def test_camera_file_projects_as_the_benchmark_says() -> None:
    rig = Rig(
        cameras=(CameraMount(name="left", width_px=2048, height_px=1024, yaw_deg=5.0, pitch_deg=3.0),),
        follows_road=True,
    )
    world_from_ego = RigidTransform.from_yaw("world", "ego", (10.0, 5.0, 0.0), 1.0)
    (record,) = rig.place(world_from_ego)
    content = camera_json(record, world_from_ego, baseline_m=0.0)
    e, i = content["extrinsic"], content["intrinsic"]
    cy, sy, cp, sp = math.cos(e["yaw"]), math.sin(e["yaw"]), math.cos(e["pitch"]), math.sin(e["pitch"])
    rotation = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]]) @ np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    point = np.array([20.0, -3.0, 0.5])
    flu = rotation.T @ (point - [e["x"], e["y"], e["z"]])
    axes = np.array([[0, -1, 0], [0, 0, -1], [1, 0, 0]])
    k = np.array([[i["fx"], 0, i["u0"]], [0, i["fy"], i["v0"]], [0, 0, 1]])
    x, y, w = k @ axes @ flu
    camera_m = record.world_from_camera_transform.inverse().apply(world_from_ego.apply(point))
    assert (x / w, y / w) == pytest.approx(record.intrinsics.project(camera_m), abs=1e-3)
    assert e["roll"] == pytest.approx(0.0, abs=1e-6)
    assert (e["yaw"], e["pitch"]) == pytest.approx((math.radians(5), math.radians(3)), abs=1e-6)


def painted(content: Any) -> np.ndarray:
    """Polygons drawn by the official tool."""
    from cityscapesscripts.helpers.annotation import Annotation
    from cityscapesscripts.preparation.json2labelImg import createLabelImage

    annotation = Annotation()
    annotation.fromJsonText(json.dumps(content))
    return np.array(createLabelImage(annotation, "ids"))


def instances() -> np.ndarray:
    """Road, sky, buildings with windows of sky, a pole before a car, a car in two pieces, specks."""
    picture = np.full((200, 300), 23, dtype=np.uint16)
    picture[120:] = 7
    cv2.fillPoly(picture, [np.array([[20, 30], [140, 10], [150, 130], [10, 140]])], 11)
    picture[50:60, 40:60] = 23
    picture[80:100, 90:120] = 21
    cv2.ellipse(picture, (220, 130), (50, 25), 10, 0, 360, 26000, -1)
    picture[20:180, 215:219] = 17
    cv2.circle(picture, (217, 20), 9, 20, -1)
    cv2.ellipse(picture, (60, 150), (30, 12), 0, 0, 360, 26001, -1)
    picture[10, 250] = 21
    return picture


def test_polygons_paint_the_map_again() -> None:
    picture = instances()
    content = polygons_json(picture)
    assert (content["imgHeight"], content["imgWidth"]) == (200, 300)
    labels = np.where(picture >= 1000, picture // 1000, picture)
    again = painted(content)
    assert (again == labels).mean() > 0.999
    # Flipped, it must not pass.
    assert (again[:, ::-1] == labels).mean() < 0.99
    names = [thing["label"] for thing in content["objects"]]
    assert names.count("car") == 3, "the pole cuts one car in two"
    assert all(len(thing["polygon"]) >= 3 for thing in content["objects"])


@pytest.mark.parametrize("seed", range(3))
def test_polygons_of_noise_stay_close(seed: int) -> None:
    rng = np.random.default_rng(seed)
    noise = cv2.GaussianBlur(rng.normal(size=(120, 160)), (0, 0), 4)
    picture = np.digitize(noise, np.quantile(noise, [0.2, 0.4, 0.6, 0.8])).astype(np.uint16) + 7
    assert (painted(polygons_json(picture)) == picture).mean() > 0.995


@pytest.mark.parametrize("rings", [1, 2])
def test_what_lies_behind_a_thin_line_is_not_painted_over(rings: int) -> None:
    """Sky inside a loop of wire holds together with the sky around it, across every place where the wire is aslant."""
    picture = np.full((120, 160), 23, np.uint16)
    for ring in range(rings):
        corners = np.array([[80, 10 + 16 * ring], [140 - 16 * ring, 60], [80, 110 - 16 * ring], [20 + 16 * ring, 60]])
        cv2.polylines(picture, [corners], True, 17)
    picture[55:65, 75:85] = 26000
    labels = np.where(picture >= 1000, picture // 1000, picture)
    assert (painted(polygons_json(picture)) == labels).all()


def test_islands_in_holes_have_outlines_too() -> None:
    """Road seen through a car's windows, and leaves in a gap of a crown."""
    picture = np.full((60, 60), 7, np.uint16)
    picture[10:50, 10:50] = 26001
    picture[20:40, 20:40] = 7
    picture[26:34, 26:34] = 26001
    content = polygons_json(picture)
    assert [thing["label"] for thing in content["objects"]] == ["road", "car", "road", "car"]
    labels = np.where(picture >= 1000, picture // 1000, picture)
    assert (painted(content) == labels).mean() > 0.97


def official_scores(root: Path, predictions: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Any, Any]:
    """The official pixel- and instance-level evaluations of a tree."""
    monkeypatch.setattr(np, "in1d", lambda a, b, **k: np.isin(np.ravel(a), b, **k), raising=False)
    monkeypatch.setenv("CITYSCAPES_DATASET", str(root))
    pixel_level = importlib.import_module("cityscapesscripts.evaluation.evalPixelLevelSemanticLabeling")
    instance_level = importlib.import_module("cityscapesscripts.evaluation.evalInstanceLevelSemanticLabeling")

    truths = sorted(str(p) for p in root.glob("gtFine/val/*/*_gtFine_labelIds.png"))
    pixel_args = pixel_level.args
    pixel_args.evalLabels = [label.id for label in official.labels if label.id >= 0]
    pixel_args.JSONOutput, pixel_args.quiet = False, True
    found = [str(predictions / Path(p).name.replace("_gtFine_labelIds", "")) for p in truths]
    with contextlib.redirect_stdout(io.StringIO()):
        pixels = pixel_level.evaluateImgLists(found, truths, pixel_args)
        instance_args = instance_level.args
        instance_args.JSONOutput, instance_args.quiet = False, True
        instance_args.gtInstancesFile = str(predictions / "gtInstances.json")
        instance_args.predictionPath = str(predictions.resolve())
        # It would write its matches into the working folder, and stumble over NumPy's integers there.
        monkeypatch.setattr(instance_level, "writeDict2JSON", lambda *_: None)
        instance_level.setInstanceLabels(instance_args)
        lists = [str(predictions / Path(p).name.replace("_gtFine_labelIds.png", ".txt")) for p in truths]
        maps = [p.replace("labelIds", "instanceIds") for p in truths]
        averages = instance_level.evaluateImgLists(lists, maps, instance_args)
    return pixels, averages


def test_the_official_tools_score_ground_truth_perfect(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import gear.plugins.tasks.semseg as plugin
    from gear.testing.task_contract import TaskContract

    class Writer(TaskContract):
        spec = plugin.semseg
        options = {"width_px": 1024, "height_px": 512}  # noqa: RUF012

    root, predictions = tmp_path / "data", tmp_path / "predictions"
    predictions.mkdir()
    Writer().write(root)
    for truth in root.glob("gtFine/val/*/*_gtFine_instanceIds.png"):
        name = truth.name.replace("_gtFine_instanceIds.png", "")
        picture = np.array(Image.open(truth))
        Image.fromarray(np.array(Image.open(str(truth).replace("instanceIds", "labelIds")))).save(
            predictions / f"{name}.png"
        )
        lines = []
        for value in np.unique(picture[picture >= 1000]):
            Image.fromarray((picture == value).astype(np.uint8) * 255).save(predictions / f"{name}_{value}_mask.png")
            lines.append(f"{name}_{value}_mask.png {value // 1000} 0.9\n")
        (predictions / f"{name}.txt").write_text("".join(lines))
    pixels, averages = official_scores(root, predictions, monkeypatch)
    assert pixels["averageScoreClasses"] == pytest.approx(1.0)
    assert pixels["averageScoreInstClasses"] == pytest.approx(1.0)
    assert pixels["averageScoreCategories"] == pytest.approx(1.0)
    scores = averages.get("averages", averages)
    assert scores["allAp"] == pytest.approx(1.0)


@pytest.mark.parametrize("yaw_rad", [0.0, 1.0, -2.0, 3.0])
def test_a_level_camera_file_has_no_negative_zero(yaw_rad: float) -> None:
    world_from_ego = RigidTransform.from_yaw("world", "ego", (10.0, 5.0, 0.0), yaw_rad)
    (record,) = Rig(cameras=(CameraMount(name="left", width_px=64, height_px=32),)).place(world_from_ego)
    extrinsic = camera_json(record, world_from_ego, baseline_m=0.0)["extrinsic"]
    assert [extrinsic[name] for name in ("pitch", "roll", "yaw")] == pytest.approx([0.0] * 3, abs=1e-9)
    assert "-0.0," not in json.dumps(extrinsic) and "-0.0}" not in json.dumps(extrinsic)
