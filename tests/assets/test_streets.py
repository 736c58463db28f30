"""What drivers before every board see of a street: no class of it is missing from a scene."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import mujoco
import numpy as np
import numpy.typing as npt
import pytest
import yaml

from tests.assets.test_town10 import VISIBLE, face_frame, is_seen, lanes

Array = npt.NDArray[np.float64]
ROOT = Path(__file__).parents[2]
TOWNS = ("town10", "suburb", "harbour")
SIGN = ("traffic_sign", "stop_sign")
CLASSES = {
    "wall": ("wall",),
    "fence": ("fence",),
    "pole": ("pole",),
    "traffic light": ("traffic_light",),
    "traffic sign": SIGN,
    "vegetation": ("vegetation",),
    "terrain": ("terrain",),
}
# There are no traffic lights on a motorway, nor where a road only bends around a terminal.
WITHOUT_LIGHTS = {("harbour", f"billboard0{index}") for index in (1, 2, 6)}
NEAR_M, FAR_M = 4.0, 150.0
TRIES = 90
# Of the places from where a driver sees a board.
LEAST = 1 / 3
RNG_SEED = 5


class Town:
    """A compiled town, and where things of each label are."""

    def __init__(self, name: str) -> None:
        spec = mujoco.MjSpec.from_file(str(ROOT / "mjcf" / "towns" / f"{name}.xml"))
        self.name, self.model = name, spec.compile()
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)
        self.scenes = yaml.safe_load((ROOT / "configs" / "scenes" / f"{name}.yml").read_text(encoding="utf-8"))[
            "scenes"
        ]
        self.label = {geom.id: geom.classname.name.split(".")[0] for geom in spec.geoms}
        self.points = {name: self._middles(labels) for name, labels in CLASSES.items()}

    def _middles(self, labels: tuple[str, ...]) -> Array:
        """The middles (N, 3) of the faces of everything with one of these labels."""
        found = []
        for geom, label in self.label.items():
            mesh = int(self.model.geom_dataid[geom])
            if label in labels and mesh >= 0:
                start, count = self.model.mesh_faceadr[mesh], self.model.mesh_facenum[mesh]
                faces = self.model.mesh_face[start : start + count] + self.model.mesh_vertadr[mesh]
                middles = self.model.mesh_vert[faces].mean(1)
                turn = self.data.geom_xmat[geom].reshape(3, 3)
                found.append(middles @ turn.T + self.data.geom_xpos[geom])
        return np.concatenate(found)

    def eyes(self, scene: str) -> list[tuple[Array, Array]]:
        """Cameras of cars that see the scene's boards, and where they head."""
        boards = self.scenes[scene]["boards"]
        origin, facing, left = face_frame(boards[0])
        ahead, lateral = (self.scenes[scene]["ego"][key] for key in ("ahead_m", "lateral_m"))
        found = []
        for _, points, _ in lanes(self.model).values():
            for start, end in pairwise(points):
                heading = (end - start) / np.linalg.norm(end - start)
                for step in np.arange(0.5, np.linalg.norm(end - start), 2.0):
                    place = start + heading * step
                    u, v = (place - origin) @ facing, (place - origin) @ left
                    if not (ahead[0] <= u <= ahead[1] and lateral[0] <= v <= lateral[1]):
                        continue
                    if is_seen(self.model, self.data, place, heading, boards[0]):
                        flat = np.array([heading[0], heading[1], 0.0]) / np.hypot(heading[0], heading[1])
                        found.append((place + flat * 1.5 + (0.0, 0.0, 1.65), flat))
        return found

    def shows(self, eye: Array, ahead: Array, kind: str, rng: np.random.Generator) -> bool:
        """Whether a camera with a field of view of 90 degrees sees anything of a class."""
        away = self.points[kind] - eye
        depth, across = away @ ahead, away @ np.array([ahead[1], -ahead[0], 0.0])
        inside = (depth > NEAR_M) & (depth < FAR_M) & (np.abs(across) < depth) & (np.abs(away[:, 2]) < depth / 2)
        chosen = away[inside]
        for target in chosen[rng.permutation(len(chosen))[:TRIES]]:
            distance = float(np.linalg.norm(target))
            geom = np.full(1, -1, np.int32)
            hit = mujoco.mj_ray(self.model, self.data, eye, target / distance, VISIBLE, 1, -1, geom, None)
            if hit >= 0 and self.label[int(geom[0])] in CLASSES[kind]:
                return True
        return False


@pytest.fixture(scope="module", params=TOWNS)
def town(request: pytest.FixtureRequest) -> Town:
    return Town(str(request.param))


def test_no_class_of_a_street_is_missing_before_a_board(town: Town) -> None:
    """From a third of the places at least from where a driver sees a board every class is seen."""
    missing = []
    for scene in town.scenes:
        if not scene.startswith("billboard"):
            continue
        eyes = town.eyes(scene)
        eyes = eyes[:: max(1, len(eyes) // 8)]
        assert eyes, scene
        rng = np.random.default_rng(RNG_SEED)
        for kind in CLASSES:
            if kind == "traffic light" and (town.name, scene) in WITHOUT_LIGHTS:
                continue
            share = np.mean([town.shows(*eye, kind, rng) for eye in eyes])
            if share < LEAST:
                missing.append(f"{scene}: {kind} in {share:.0%} of {len(eyes)} places")
    assert not missing, missing
