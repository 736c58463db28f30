"""Linear light: repeatable, linear in every face, and dressed by the stage alone."""

from __future__ import annotations

import copy
import hashlib
import subprocess
import sys

import mujoco
import numpy as np
import pytest

from gear.camera import face_light
from gear.contracts.rendering import Quality, RawView, Renderer, Stage
from gear.render import RENDERERS, display_colours, open_renderer, probe
from gear.values.frames import LINEAR_FULL_SCALE, UInt8Image, UInt16Image
from tests.render.conftest import STREET, camera, geom, grey_face, posed

LEVEL = LINEAR_FULL_SCALE / 255


def dressed(stage: Stage, face: UInt8Image | None = None, paint: tuple[float, float, float] | None = None) -> Stage:
    model = stage.model
    return Stage(
        model=model,
        data=stage.data,
        paint_rgb={} if paint is None else {geom(model, "car"): paint},
        faces={} if face is None else {geom(model, "face"): face},
    )


def colour(renderer: Renderer, stage: Stage) -> UInt16Image:
    (view,) = renderer.render(stage, (camera(),))
    assert view.linear_rgb is not None
    return view.linear_rgb


def face_pixels(renderer: Renderer, stage: Stage) -> np.ndarray:
    (view,) = renderer.render(stage, (camera(),), colour=False)
    return view.geom_id == geom(stage.model, "face")


def digest(view: RawView) -> str:
    arrays = (view.linear_rgb, view.depth_m, view.geom_id)
    return hashlib.sha256(b"".join(np.ascontiguousarray(a).tobytes() for a in arrays if a is not None)).hexdigest()


def test_frames_are_uint16_and_use_the_scale(renderer: Renderer, stage: Stage) -> None:
    frame = colour(renderer, stage)
    assert frame.shape == (96, 160, 3) and frame.dtype == np.uint16
    assert LINEAR_FULL_SCALE * 0.1 < frame.max() <= LINEAR_FULL_SCALE


def test_a_frame_depends_on_its_stage_and_camera_alone(renderer: Renderer, stage: Stage, model: mujoco.MjModel) -> None:
    (first,) = renderer.render(stage, (camera(),))
    (again,) = renderer.render(stage, (camera(),))
    assert digest(first) == digest(again)
    other_data = mujoco.MjData(model)
    other_data.mocap_pos[0] = (8.0, 2.0, 0.7)
    mujoco.mj_forward(model, other_data)
    other = dressed(Stage(model=model, data=other_data), grey_face(255), (0.0, 0.0, 0.9))
    (different,) = renderer.render(other, (camera(64, 48),))
    (later,) = renderer.render(stage, (camera(),))
    assert digest(first) == digest(later) != digest(different)


def test_cameras_of_one_call_are_like_cameras_alone(renderer: Renderer, stage: Stage) -> None:
    rig = (camera(), camera(y_m=-0.3), camera(96, 64, yaw_deg=-20))
    together = renderer.render(stage, rig)
    alone = [renderer.render(stage, (record,))[0] for record in reversed(rig)]
    assert [digest(view) for view in together] == [digest(view) for view in reversed(alone)]
    assert len({digest(view) for view in together}) == 3


def test_shapes_that_are_known_are_not_drawn_again(renderer: Renderer, stage: Stage) -> None:
    rig = (camera(), camera(96, 64, yaw_deg=-20))
    shapes = renderer.render(stage, rig, colour=False)
    other = dressed(stage, grey_face(200), (0.0, 0.0, 0.9))
    plain = renderer.render(other, rig)
    taken = renderer.render(other, rig, shapes=shapes)
    assert [digest(view) for view in taken] == [digest(view) for view in plain]
    for view, shape in zip(taken, shapes, strict=True):
        assert view.depth_m is shape.depth_m and view.geom_id is shape.geom_id
    elsewhere = renderer.render(other, (camera(yaw_deg=9), rig[1]), colour=False)
    assert digest(renderer.render(other, rig, shapes=elsewhere)[0]) != digest(plain[0]), "they are what shades it"
    with pytest.raises(ValueError, match="zip"):
        renderer.render(other, rig, shapes=shapes[:1])


@pytest.mark.parametrize("name", RENDERERS)
def test_a_fresh_process_renders_the_same_bytes(name: str) -> None:
    code = f"from gear.render import probe; print(probe({name!r}).sha256)"
    fresh = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert fresh.stdout == probe(name).sha256 + "\n"
    assert fresh.stderr == ""


def test_faces_are_linear(renderer: Renderer, stage: Stage) -> None:
    black, white = (colour(renderer, dressed(stage, grey_face(v))).astype(float) for v in (0, 255))
    assert (white - black).max() > 100
    for value in (60, 128, 200):
        weight = float(face_light(renderer.info.name, np.array([value], np.uint8))[0])
        expected = black + weight * (white - black)
        got = colour(renderer, dressed(stage, grey_face(value)))
        assert np.abs(got - expected).max() <= 2 * LEVEL


def test_a_face_changes_no_pixel_that_it_does_not_reach(renderer: Renderer, stage: Stage) -> None:
    difference = np.abs(
        colour(renderer, dressed(stage, grey_face(0))).astype(int) - colour(renderer, dressed(stage, grey_face(255)))
    ).max(axis=-1)
    reach = face_pixels(renderer, stage).astype(np.uint8)
    around = np.zeros_like(reach)
    for down in (-1, 0, 1):
        for across in (-1, 0, 1):
            around |= np.roll(reach, (down, across), (0, 1))
    assert (difference[around == 0] == 0).all()
    assert (difference[reach == 1] > 0).mean() > 0.95


def test_a_face_is_the_right_way_round(renderer: Renderer, stage: Stage) -> None:
    quarters = np.zeros((32, 64, 3), np.uint8)
    quarters[:16, :32] = (255, 0, 0)
    quarters[:16, 32:] = (0, 255, 0)
    quarters[16:, :32] = (0, 0, 255)
    quarters[16:, 32:] = (255, 255, 255)
    frame = colour(renderer, dressed(stage, quarters)).astype(int)
    record = camera()
    # The face spans 4 m x 2 m about (14, 1, 2.2) and is seen from the west: its viewer's right is -y.
    for right_m, down_m, shown in ((-1, -0.5, [0]), (1, -0.5, [1]), (-1, 0.5, [2]), (1, 0.5, [0, 1, 2])):
        point = record.world_from_camera_transform.inverse().apply((14.0, 1.0 - right_m, 2.2 - down_m))
        column, row = np.round(record.intrinsics.project(point)).astype(int)
        pixel = frame[row, column]
        hidden = [channel for channel in range(3) if channel not in shown]
        assert pixel[shown].min() > 1.5 * (pixel[hidden].max() if hidden else 20)


def test_paint_is_applied_and_removed(renderer: Renderer, stage: Stage) -> None:
    plain = colour(renderer, stage)
    (view,) = renderer.render(stage, (camera(),), colour=False)
    car = view.geom_id == geom(stage.model, "car")
    assert (plain[car][:, 0].mean()) > 2 * plain[car][:, 2].mean()
    blue = colour(renderer, dressed(stage, paint=(0.02, 0.02, 0.5)))
    assert blue[car][:, 2].mean() > 2 * blue[car][:, 0].mean()
    assert np.array_equal(colour(renderer, stage), plain)


def test_paint_equals_the_same_colour_in_the_model(renderer: Renderer, stage: Stage, model: mujoco.MjModel) -> None:
    painted = colour(renderer, dressed(stage, paint=(0.02, 0.4, 0.1)))
    compiled = mujoco.MjModel.from_xml_string(STREET.replace("0.5 0.02 0.02", "0.02 0.4 0.1"))
    quality = "film" if renderer_is_film(renderer) else "fast"
    other = open_renderer(renderer.info.name, compiled, quality=quality)
    try:
        assert np.array_equal(colour(other, Stage(model=compiled, data=posed(compiled))), painted)
    finally:
        other.close()


def renderer_is_film(renderer: Renderer) -> bool:
    return bool(getattr(renderer, "_quality") == "film")  # noqa: B009


def test_a_face_equals_the_same_texture_in_the_model(
    renderer: Renderer, stage: Stage, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Classic lifts the textures that a model brings, never those of faces: exempt from it they look like one."""
    worn = colour(renderer, dressed(stage, np.full((32, 64, 3), (200, 90, 30), np.uint8)))
    texture = f'rgb1="{200 / 255} {90 / 255} {30 / 255}"'
    compiled = mujoco.MjModel.from_xml_string(STREET.replace('rgb1="0.5 0.5 0.5"', texture))
    assert tuple(compiled.tex_data[:3]) == (200, 90, 30)
    face_texture = compiled.mat_texid[compiled.geom_matid[geom(compiled, "face")], mujoco.mjtTextureRole.mjTEXROLE_RGB]

    def lift_others(model: mujoco.MjModel, textures: np.ndarray) -> None:
        lift_textures(model, textures[textures != face_texture])

    lift_textures = display_colours._lift_textures
    monkeypatch.setattr(display_colours, "_lift_textures", lift_others)
    quality: Quality = "film" if renderer_is_film(renderer) else "fast"
    other = open_renderer(renderer.info.name, compiled, quality=quality)
    try:
        assert np.array_equal(colour(other, Stage(model=compiled, data=posed(compiled))), worn)
    finally:
        other.close()


def test_many_faces_do_not_pile_up(renderer: Renderer, stage: Stage) -> None:
    plain = colour(renderer, stage)
    for value in range(0, 240, 6):
        colour(renderer, dressed(stage, grey_face(value)))
    assert np.array_equal(colour(renderer, stage), plain)


def test_the_shared_model_is_never_changed(renderer: Renderer, stage: Stage) -> None:
    before = copy.copy(stage.model)
    colour(renderer, dressed(stage, grey_face(255), (0.1, 0.2, 0.3)))
    for name in ("tex_data", "geom_rgba", "mat_rgba", "light_diffuse", "light_active", "tex_colorspace"):
        assert np.array_equal(getattr(before, name), getattr(stage.model, name)), name


def test_shadows_fall_away_from_the_sun(renderer: Renderer, stage: Stage) -> None:
    (view,) = renderer.render(stage, (camera(320, 192),))
    assert view.linear_rgb is not None
    record = camera(320, 192)
    camera_from_world = record.world_from_camera_transform.inverse()

    def road_at(x_m: float, y_m: float) -> float:
        column, row = np.round(record.intrinsics.project(camera_from_world.apply((x_m, y_m, 0.0)))).astype(int)
        assert view.linear_rgb is not None
        assert view.geom_id[row, column] == geom(stage.model, "road")
        return float(view.linear_rgb[row, column].sum())

    # The sun shines along (0.6, 0.3, -0.7): what stands 1.4 m above (8.6, -3.2) shades (9.8, -2.6).
    assert road_at(9.6, -2.1) < 0.7 * road_at(7.5, -3.9)


def test_what_does_not_fit_is_refused(renderer: Renderer, stage: Stage) -> None:
    with pytest.raises(ValueError, match="face of geom"):
        renderer.render(dressed(stage, np.zeros((16, 16, 3), np.uint8)), (camera(),))
    with pytest.raises(ValueError, match="no colour texture"):
        faces = {geom(stage.model, "road"): grey_face(0)}
        renderer.render(Stage(model=stage.model, data=stage.data, faces=faces), (camera(),))
    other = mujoco.MjModel.from_xml_string(STREET)
    with pytest.raises(ValueError, match="another model"):
        renderer.render(Stage(model=other, data=posed(other)), (camera(),))


@pytest.mark.parametrize("name", RENDERERS)
def test_renderers_close_twice_and_open_again(name: str, model: mujoco.MjModel, stage: Stage) -> None:
    frames = []
    for _ in range(3):
        opened = open_renderer(name, model, quality="fast")
        frames.append(colour(opened, stage))
        opened.close()
        opened.close()
    assert np.array_equal(frames[0], frames[1]) and np.array_equal(frames[1], frames[2])
