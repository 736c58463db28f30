import numpy as np
import pytest

from gear.testing.town_scenes import NOTHING, pinholes
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
