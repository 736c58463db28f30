"""A map shows things where they are."""

from __future__ import annotations

from gear.values.frames import UInt8Image
from gear.verbs.towns import ground_layer

from .conftest import pixel


def test_the_map_shows_things_where_they_are(tiny_map: UInt8Image) -> None:
    terrain, _, road, parking, sidewalk, _ = (colour for _, _, colour in ground_layer.COVERS)
    assert pixel(tiny_map, -37, 25) == pixel(tiny_map, 3, -22) == ground_layer.BUILDING
    assert pixel(tiny_map, -37, -25) == pixel(tiny_map, 37, 55) == pixel(tiny_map, -60, 30) == terrain
    assert pixel(tiny_map, -70, 3) == pixel(tiny_map, 30, 50) == pixel(tiny_map, 30, -50) == road
    assert pixel(tiny_map, -15, 5.2) == parking
    assert pixel(tiny_map, -70, 8.5) == pixel(tiny_map, 77, -4) == sidewalk
    for lane in ((31.75, 30.0), (28.25, -30.0)):  # thin, so its edges are mixed with the road's grey
        red, _, blue = pixel(tiny_map, *lane)
        assert blue - red > 40
    assert min(pixel(tiny_map, 22, 0.57)) > max(pixel(tiny_map, 19, 0.57))
