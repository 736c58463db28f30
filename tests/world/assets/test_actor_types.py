"""Bodies with all that is below them."""

from __future__ import annotations

import mujoco

from gear.world.assets.actor_types import body_tree


def test_a_body_is_followed_by_all_that_is_below_it() -> None:
    spec = mujoco.MjSpec()
    first, second = (spec.worldbody.add_body(name=name) for name in ("first", "second"))
    # Added last, numbered in the middle.
    below = second.add_body(name="below")
    arm = first.add_body(name="arm")
    arm.add_body(name="hand")
    first.add_body(name="other arm")
    below.add_body(name="deep")
    model = spec.compile()

    def names(body: str) -> list[str]:
        return [model.body(number).name for number in body_tree(model, model.body(body).id)]

    assert names("first") == ["first", "arm", "hand", "other arm"]
    assert names("arm") == ["arm", "hand"] and names("hand") == ["hand"]
    assert names("second") == ["second", "below", "deep"] and names("deep") == ["deep"]
    assert len(names("world")) == model.nbody == 8
