import numpy as np
import pytest

from gear.testing.town_scenes import NOTHING, pinholes, slivers
from gear.values.labels import LABEL_BY_NAME

SIDEWALK, GROUND, BUILDING, PERSON = (LABEL_BY_NAME[n].code for n in ("sidewalk", "ground", "building", "person"))


def picture(around: int, depth_m: float = 20.0) -> tuple[np.ndarray, np.ndarray]:
    return np.full((6, 8), around, np.uint8), np.full((6, 8), depth_m, np.float32)


@pytest.mark.parametrize(
    ("around", "within", "depth_m"),
    [(SIDEWALK, GROUND, 23.0), (BUILDING, NOTHING, np.nan), (BUILDING, SIDEWALK, 60.0)],
)
def test_a_pixel_behind_one_surface_is_a_pinhole(around: int, within: int, depth_m: float) -> None:
    labels, depths = picture(around)
    labels[2, 5], depths[2, 5] = within, depth_m
    assert pinholes(labels, depths).tolist() == [[2, 5]]


def test_what_is_no_crack_is_none() -> None:
    cases = []
    cases.append(picture(SIDEWALK))
    nearer = picture(SIDEWALK)
    nearer[0][2, 5], nearer[1][2, 5] = PERSON, 5.0
    same_label = picture(SIDEWALK)
    same_label[1][2, 5] = 60.0
    at_the_surface = picture(SIDEWALK)
    at_the_surface[0][2, 5] = GROUND
    two_pixels = picture(SIDEWALK)
    two_pixels[0][2, 4:6], two_pixels[1][2, 4:6] = GROUND, 60.0
    between_things = picture(PERSON)
    between_things[0][2, 5], between_things[1][2, 5] = NOTHING, np.nan
    at_an_edge = picture(BUILDING)
    at_an_edge[1][:, 5:] = 40.0
    at_an_edge[0][2, 5], at_an_edge[1][2, 5] = NOTHING, np.nan
    cases += [nearer, same_label, at_the_surface, two_pixels, between_things, at_an_edge]
    assert [pinholes(*case).size for case in cases] == [0] * len(cases)


def test_a_thin_strip_of_ground_at_the_foot_of_a_wall_is_found() -> None:
    labels = np.full((8, 12), BUILDING, np.uint8)
    labels[4:] = SIDEWALK
    labels[3, [1, 2, 5]] = GROUND  # along the wall, a piece open here and there
    labels[4, 6] = GROUND  # touches the second piece by a corner
    labels[6, 10] = GROUND
    assert slivers(labels).tolist() == [[3, 1], [3, 5], [6, 10]]


def test_yards_and_ground_beside_other_things_are_no_slivers() -> None:
    yard = np.full((8, 12), SIDEWALK, np.uint8)
    yard[2, 3:7] = GROUND
    beside_a_person = np.full((8, 12), SIDEWALK, np.uint8)
    beside_a_person[2:4, 3], beside_a_person[2, 4] = PERSON, GROUND
    at_the_horizon = np.full((8, 12), SIDEWALK, np.uint8)
    at_the_horizon[:3], at_the_horizon[3, 4] = NOTHING, GROUND
    assert [slivers(labels).size for labels in (yard, beside_a_person, at_the_horizon)] == [0, 0, 0]
