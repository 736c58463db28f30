"""A worker's session, opened for a job of this machine and of another one."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace
from typing import Any

import pytest

from gear.collecting import session as module
from gear.collecting.devices import planned_renderer, planned_versions
from gear.collecting.job import Job, versions
from gear.collecting.session import open_session
from gear.contracts.rendering import RendererInfo
from gear.values.errors import BackendError

HERE = RendererInfo(name="raster", backend="egl", driver="4.5 Mesa", device="llvmpipe", is_software=True)


@pytest.fixture
def closed(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """No world is compiled; says which renderers were closed."""
    closed: list[str] = []
    renderer = SimpleNamespace(info=HERE, close=lambda: closed.append("raster"))
    for name in ("find", "night_of", "release_render_arrays", "ScenePlanner", "camera_pipeline"):
        monkeypatch.setattr(module, name, lambda *_, **__: None)
    monkeypatch.setattr(module, "build", lambda *_: SimpleNamespace(rig=lambda: None))
    monkeypatch.setattr(module, "blamed", lambda *_: _Nothing())
    monkeypatch.setattr(
        module, "load_or_compile", lambda **_: SimpleNamespace(model=None, town_name="town10", shapes=None, shelf=None)
    )
    monkeypatch.setattr(module, "open_renderer", lambda *_, **__: renderer)
    return closed


class _Nothing:
    def __enter__(self) -> None: ...

    def __exit__(self, *_: object) -> None: ...


def job_of(info: RendererInfo, changed: dict[str, str], *, mixed: bool = False) -> Any:
    config = SimpleNamespace(
        task="depth", options=None, town="town10", scene="billboard01", renderer="raster", quality="film",
        split="test", camera=None,
    )  # fmt: skip
    content = {
        "renderer": planned_renderer(info, mixed=mixed),
        "versions": {**planned_versions(versions(), mixed=mixed), **changed},
    }
    plan = SimpleNamespace(content=content)
    return SimpleNamespace(config=config, scene=None, weather=None, split=None, renderer=info, plan=plan)


def test_a_worker_of_the_plans_renderer_and_versions_is_opened_and_closed(closed: list[str]) -> None:
    job: Job = job_of(HERE, {})
    with open_session(job) as session:
        assert session.renderer.info == HERE and not closed
    assert closed == ["raster"]


@pytest.mark.parametrize(
    ("info", "changed", "said"),
    [
        (
            dataclasses.replace(HERE, device="H200"),
            {},
            'renderer.device: "H200" in the plan, "llvmpipe" on this worker',
        ),
        (HERE, {"mujoco": "3.0.0"}, r'versions.mujoco: "3.0.0" in the plan, ".*" on this worker'),
    ],
)
def test_a_worker_with_another_renderer_or_version_is_refused(
    info: RendererInfo, changed: dict[str, str], said: str, closed: list[str]
) -> None:
    job: Job = job_of(info, changed)
    with pytest.raises(BackendError, match=f"renderer raster: this worker would make other pictures .{said}"):
        open_session(job).__enter__()
    assert closed == ["raster"]


def test_mixed_devices_share_a_split_that_names_each_of_them(closed: list[str]) -> None:
    other = dataclasses.replace(HERE, backend="vulkan", driver="550.1", device="H200", is_software=False)
    job: Job = job_of(other, {}, mixed=True)
    with open_session(job) as session:
        assert session.device == {
            "backend": "egl", "driver": "4.5 Mesa", "device": "llvmpipe", "machine": versions()["machine"]
        }  # fmt: skip
    with open_session(job_of(HERE, {})) as session:
        assert session.device == {}


@pytest.mark.parametrize(
    ("info", "changed"), [(dataclasses.replace(HERE, name="classic"), {}), (HERE, {"mujoco": "3.0.0"})]
)
def test_mixed_devices_still_need_one_renderer_and_the_same_packages(
    info: RendererInfo, changed: dict[str, str], closed: list[str]
) -> None:
    with pytest.raises(BackendError, match="this worker would make other pictures"):
        open_session(job_of(info, changed, mixed=True)).__enter__()
