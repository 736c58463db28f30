"""Actors of what is felt weigh what their assets weigh and stand on four feet at the corners of their stance."""

from __future__ import annotations

import numpy as np
import pytest

from gear.testing.tiny_town import tiny_world
from gear.world.compilation.model_compilation import FOOT_GROUP, FOOT_RADIUS_M


@pytest.mark.parametrize("scene", ["no_billboard", "truck"])
def test_actors_stand_as_their_assets_do(scene: str) -> None:
    world = tiny_world(scene)
    felt = world.placement_model
    assert len(world.slots) > 5
    for slot in world.slots:
        wanted, body = world.types[slot.actor.name].placement_body, felt.body(slot.body)
        length_m, width_m, height_m = (
            2 * wanted.half_length_m,
            2 * wanted.half_width_m,
            wanted.height_m,
        )
        assert body.mass[0] == pytest.approx(wanted.mass_kg, rel=1e-5)
        assert body.ipos == pytest.approx([0, 0, 0.4 * height_m], rel=1e-5)
        squares = np.square([length_m, width_m, height_m])
        assert body.inertia == pytest.approx(wanted.mass_kg / 12 * (squares.sum() - squares), rel=1e-4)
        first, count = int(body.geomadr[0]), int(body.geomnum[0])
        feet = [g for g in range(first, first + count) if felt.geom_group[g] == FOOT_GROUP]
        assert [felt.geom(g).name for g in feet] == [f"{slot.body}_foot_{k}" for k in range(4)]
        corners = {(round(float(x), 4), round(float(y), 4)) for x, y, _ in felt.geom_pos[feet]}
        assert corners == {(s * round(length_m / 2, 4), t * round(width_m / 2, 4)) for s in (1, -1) for t in (1, -1)}
        assert felt.geom_pos[feet, 2] == pytest.approx(FOOT_RADIUS_M)
