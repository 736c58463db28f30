"""Reads exported driving sequences with other people's tools, and prints what they find.

    python benchmarks/driving_data.py tracking EXPORT     # layout kitti-tracking or mot: TrackEval, py-motmetrics
    python benchmarks/driving_data.py odometry EXPORT RAW # layouts kitti-odometry and kitti-raw: pykitti
    python benchmarks/driving_data.py flow EXPORT         # layout kitti-flow: the second picture pulled back

The tools are no dependencies of gear: `pip install trackeval motmetrics pykitti`. In `tracking`, the ground truth is
also the result of the tracker, so every metric must be 1. `odometry` compares the poses of both layouts. `flow` prints
the difference of grey levels between the first picture and the second one pulled back by the flow, over the pixels
whose point both pictures show: with the flow, without it, and with a flow that is one pixel off.
"""

from __future__ import annotations

import argparse
import importlib
import tempfile
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

METRICS = ("HOTA", "CLEAR", "Identity")


def tracking(folder: Path) -> None:
    """Evaluates the ground truth of an export as if a tracker had found it."""
    trackeval: Any = importlib.import_module("trackeval")
    with tempfile.TemporaryDirectory() as work:
        quiet = {"PRINT_CONFIG": False, "TRACKERS_FOLDER": work}
        if (folder / "training/label_02").is_dir():
            results = Path(work, "truth/data")
            results.mkdir(parents=True)
            for file in (folder / "training/label_02").glob("*.txt"):
                lines = [line for line in file.read_text().splitlines() if " DontCare " not in line]
                (results / file.name).write_text("".join(f"{line} 1.0\n" for line in lines))
            settings = {"GT_FOLDER": str(folder / "training"), "SPLIT_TO_EVAL": "training"}
            _evaluate(trackeval, trackeval.datasets.Kitti2DBox(settings | quiet))
            return
        pool = next(folder.glob("gear-*"))
        results = Path(work, pool.name, "truth/data")
        results.mkdir(parents=True)
        for file in sorted(pool.glob("*/gt/gt.txt")):
            rows = [line.split(",") for line in file.read_text().splitlines()]
            found = [",".join([*row[:6], "1,-1,-1,-1"]) for row in rows if row[6:8] == ["1", "1"]]
            (results / f"{file.parents[1].name}.txt").write_text("".join(f"{line}\n" for line in found))
        settings = {"GT_FOLDER": str(folder), "BENCHMARK": "gear", "SPLIT_TO_EVAL": pool.name.removeprefix("gear-")}
        _evaluate(trackeval, trackeval.datasets.MotChallenge2DBox(settings | quiet))
        _motmetrics(sorted(pool.glob("*/gt/gt.txt")))


def _evaluate(trackeval: Any, dataset: Any) -> None:
    keys = ("PRINT_RESULTS", "PRINT_CONFIG", "OUTPUT_SUMMARY", "OUTPUT_DETAILED", "PLOT_CURVES", "TIME_PROGRESS")
    evaluator = trackeval.Evaluator(dict.fromkeys(keys, False) | {"BREAK_ON_ERROR": True})
    metrics = [getattr(trackeval.metrics, name)() for name in METRICS]
    for trackers in evaluator.evaluate([dataset], metrics)[0].values():
        for kind, found in trackers["truth"]["COMBINED_SEQ"].items():
            counts = (found["Count"]["GT_Dets"], found["Count"]["GT_IDs"])
            values = (np.mean(found["HOTA"]["HOTA"]), found["CLEAR"]["MOTA"], found["Identity"]["IDF1"])
            print(f"{kind}: {counts[0]} boxes of {counts[1]} tracks; HOTA, MOTA, IDF1: {values}")


def _motmetrics(files: list[Path]) -> None:
    if not hasattr(np, name := "asfarray"):  # py-motmetrics 1.4.0 asks for it, NumPy 2 has it no more
        setattr(np, name, lambda values: np.asarray(values, float))
    motmetrics: Any = importlib.import_module("motmetrics")
    truths = [motmetrics.io.loadtxt(str(file), fmt="mot16", min_confidence=1) for file in files]
    pairs = [motmetrics.utils.compare_to_groundtruth(one, one, "iou", distth=0.5) for one in truths]
    asked = ["num_frames", "num_objects", "num_unique_objects", "mota", "idf1", "num_switches"]
    print(motmetrics.metrics.create().compute_many(pairs, metrics=asked, generate_overall=True).iloc[-1].to_dict())


def odometry(folder: Path, raw: Path) -> None:
    """Compares the poses of `kitti-odometry` with those that the readings of `kitti-raw` give."""
    pykitti: Any = importlib.import_module("pykitti")
    date = min(raw.iterdir()).name
    for number, _ in enumerate(sorted((folder / "sequences").iterdir())):
        sequence = pykitti.odometry(str(folder), f"{number:02d}")
        drive = pykitti.raw(str(raw), date, f"{number + 1:04d}")
        poses, camera_from_imu = np.array(sequence.poses), drive.calib.T_cam0_imu
        world_from_camera = np.array([one.T_w_imu @ np.linalg.inv(camera_from_imu) for one in drive.oxts])
        error = np.abs(np.linalg.inv(world_from_camera[0]) @ world_from_camera - poses)
        length_m = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1).sum()
        turn_deg = np.degrees(max(abs(one.packet.wz) for one in drive.oxts))
        print(
            f"sequence {number}: {len(poses)} frames, {length_m:.2f} m, up to {turn_deg:.1f} degrees per second;"
            f" readings and poses differ by {error[:, :3, 3].max():.1e} m and {error[:, :3, :3].max():.1e}"
        )


def flow(folder: Path) -> None:
    """Pulls the second picture of each pair back by the flow, and compares it with the first one."""
    differences: dict[str, list[npt.NDArray[Any]]] = {"the flow": [], "no flow": [], "one pixel off": []}
    shares: list[tuple[float, float]] = []
    for file in sorted((folder / "training/flow_noc").glob("*.png")):
        flow_px, is_shown = _read_flow(file)
        _, is_valid = _read_flow(folder / "training/flow_occ" / file.name)
        first, second = (
            cv2.imread(str(folder / "training/image_2" / file.name.replace("_10", number))) for number in ("_10", "_11")
        )
        assert first is not None and second is not None
        row, column = np.indices(is_shown.shape, np.float32)
        for name, factor, off_px in (("the flow", 1, 0), ("no flow", 0, 0), ("one pixel off", 1, 1)):
            x, y = column + factor * flow_px[..., 0] + off_px, row + factor * flow_px[..., 1]
            pulled = cv2.remap(second, x, y, cv2.INTER_LINEAR).astype(float)
            differences[name].append(np.abs(pulled - first).mean(axis=-1)[is_shown])
        shares.append((float(is_valid.mean()), float(is_shown.mean())))
    valid, shown = np.mean(shares, axis=0)
    print(f"{len(shares)} pairs; valid {valid:.4f}, shown by both pictures {shown:.4f}")
    for name, values in differences.items():
        all_values = np.concatenate(values)
        print(f"{name}: mean {all_values.mean():.2f}, median {np.median(all_values):.2f} grey levels")


def _read_flow(file: Path) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.bool_]]:
    """KITTI's formula, as in the development kit: (H, W, 2) flow in pixels, and (H, W) validity."""
    stored = cv2.imread(str(file), cv2.IMREAD_ANYDEPTH | cv2.IMREAD_COLOR)
    assert stored is not None
    rgb = stored[..., ::-1].astype(np.float32)
    return (rgb[..., :2] - 2**15) / 64, rgb[..., 2] > 0


def main() -> None:
    """Reads the arguments and runs one check."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("check", choices=("tracking", "odometry", "flow"))
    parser.add_argument("folders", nargs="+", type=Path)
    asked = parser.parse_args()
    if len(asked.folders) != (2 if asked.check == "odometry" else 1):
        parser.error("odometry takes two folders, the other checks take one")
    if asked.check == "odometry":
        odometry(asked.folders[0], asked.folders[1])
    else:
        (tracking if asked.check == "tracking" else flow)(asked.folders[0])


if __name__ == "__main__":
    main()
