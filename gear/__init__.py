"""gear: driving datasets with physical adversarial patches in them, rendered by MuJoCo.

    import gear

    report = gear.collect("stereo3d", scene="billboard01", patch="random", out="data/random")
    dataset = gear.open_dataset("data/random", split="test")
    sample = dataset[0]  # typed fields: images, objects, surfaces, metadata of the scene

Each public name is imported when it is first used, so `import gear` takes almost no time.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from gear.values.triton_import import bind_triton_to_its_own_symbols

if TYPE_CHECKING:
    from gear.collecting.run import CollectReport
    from gear.measuring.gap.report import GapReport
    from gear.plugins.datasets import Dataset, Twins, open_dataset, open_twins
    from gear.values.errors import GearError
    from gear.verbs.attack.drives.run import attack_drive
    from gear.verbs.attack.per_scene import attack_scenes
    from gear.verbs.attack.report import AttackReport
    from gear.verbs.attack.run import attack
    from gear.verbs.bench.report import BenchReport
    from gear.verbs.bench.run import bench
    from gear.verbs.bench.sweep import SweepReport, sweep
    from gear.verbs.collect.run import collect
    from gear.verbs.defend.run import DefendReport, defend
    from gear.verbs.doctor import DoctorReport, doctor
    from gear.verbs.drive.report import DriveReport
    from gear.verbs.drive.run import drive
    from gear.verbs.evaluate.report import EvaluateReport
    from gear.verbs.evaluate.run import evaluate
    from gear.verbs.export import export
    from gear.verbs.gap.run import gap
    from gear.verbs.import_archive.run import ImportReport, import_archive
    from gear.verbs.leaderboard.build import BoardReport, build_leaderboard
    from gear.verbs.leaderboard.check import check_record
    from gear.verbs.merge import MergeReport, merge
    from gear.verbs.models import ModelFacts, list_models
    from gear.verbs.plugins import list_plugins
    from gear.verbs.sheet import sheet
    from gear.verbs.towns.facts import Town, read_town, towns
    from gear.verbs.towns.write import TownReport, write_town
    from gear.verbs.train.run import TrainReport, train
    from gear.verbs.verify.report import VerifyReport
    from gear.verbs.verify.run import verify
    from gear.verbs.weights.average import average_weights
    from gear.verbs.weights.convert import ConvertReport, convert_weights
    from gear.view.fiftyone_dataset import to_fiftyone
    from gear.view.rerun_recording import to_rerun
    from gear.view.write import ViewReport, write_view

__all__ = [
    "AttackReport",
    "BenchReport",
    "BoardReport",
    "CollectReport",
    "ConvertReport",
    "Dataset",
    "DefendReport",
    "DoctorReport",
    "DriveReport",
    "EvaluateReport",
    "GapReport",
    "GearError",
    "ImportReport",
    "MergeReport",
    "ModelFacts",
    "SweepReport",
    "Town",
    "TownReport",
    "TrainReport",
    "Twins",
    "VerifyReport",
    "ViewReport",
    "attack",
    "attack_drive",
    "attack_scenes",
    "average_weights",
    "bench",
    "build_leaderboard",
    "check_record",
    "collect",
    "convert_weights",
    "defend",
    "doctor",
    "drive",
    "evaluate",
    "export",
    "gap",
    "import_archive",
    "list_models",
    "list_plugins",
    "merge",
    "open_dataset",
    "open_twins",
    "read_town",
    "sheet",
    "sweep",
    "to_fiftyone",
    "to_rerun",
    "towns",
    "train",
    "verify",
    "write_town",
    "write_view",
]

_HOME = {
    "AttackReport": "gear.verbs.attack.report",
    "BenchReport": "gear.verbs.bench.report",
    "BoardReport": "gear.verbs.leaderboard.build",
    "CollectReport": "gear.collecting.run",
    "ConvertReport": "gear.verbs.weights.convert",
    "Dataset": "gear.plugins.datasets",
    "DefendReport": "gear.verbs.defend.run",
    "DoctorReport": "gear.verbs.doctor",
    "DriveReport": "gear.verbs.drive.report",
    "EvaluateReport": "gear.verbs.evaluate.report",
    "GapReport": "gear.measuring.gap.report",
    "GearError": "gear.values.errors",
    "ImportReport": "gear.verbs.import_archive.run",
    "MergeReport": "gear.verbs.merge",
    "ModelFacts": "gear.verbs.models",
    "SweepReport": "gear.verbs.bench.sweep",
    "Town": "gear.verbs.towns.facts",
    "TownReport": "gear.verbs.towns.write",
    "TrainReport": "gear.verbs.train.run",
    "Twins": "gear.plugins.datasets",
    "VerifyReport": "gear.verbs.verify.report",
    "ViewReport": "gear.view.write",
    "attack": "gear.verbs.attack.run",
    "attack_drive": "gear.verbs.attack.drives.run",
    "attack_scenes": "gear.verbs.attack.per_scene",
    "bench": "gear.verbs.bench.run",
    "build_leaderboard": "gear.verbs.leaderboard.build",
    "check_record": "gear.verbs.leaderboard.check",
    "average_weights": "gear.verbs.weights.average",
    "collect": "gear.verbs.collect.run",
    "convert_weights": "gear.verbs.weights.convert",
    "defend": "gear.verbs.defend.run",
    "doctor": "gear.verbs.doctor",
    "drive": "gear.verbs.drive.run",
    "evaluate": "gear.verbs.evaluate.run",
    "export": "gear.verbs.export",
    "gap": "gear.verbs.gap.run",
    "list_models": "gear.verbs.models",
    "list_plugins": "gear.verbs.plugins",
    "import_archive": "gear.verbs.import_archive.run",
    "merge": "gear.verbs.merge",
    "open_dataset": "gear.plugins.datasets",
    "open_twins": "gear.plugins.datasets",
    "read_town": "gear.verbs.towns.facts",
    "sheet": "gear.verbs.sheet",
    "sweep": "gear.verbs.bench.sweep",
    "to_fiftyone": "gear.view.fiftyone_dataset",
    "to_rerun": "gear.view.rerun_recording",
    "towns": "gear.verbs.towns.facts",
    "train": "gear.verbs.train.run",
    "verify": "gear.verbs.verify.run",
    "write_town": "gear.verbs.towns.write",
    "write_view": "gear.view.write",
}

bind_triton_to_its_own_symbols()  # importing MuJoCo may load Mesa, and a training or a defense may import Triton


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'gear' has no attribute {name!r}")
    if name != "GearError":
        importlib.import_module("gear.values.mujoco_gl").check_mujoco_gl()
    return getattr(importlib.import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
