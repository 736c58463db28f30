"""`MUJOCO_GL` is checked before MuJoCo reads it."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest


def run(value: str, code: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "MUJOCO_GL": value}
    return subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("value", ["glx", "wgl", "cgl", "bogus"])
def test_the_command_line_refuses_what_needs_a_window_in_one_line(value: str) -> None:
    done = run(value, "import sys; from gear.cli.main import main; sys.exit(main(['doctor']))")
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr.splitlines() == [
        f"gear: MUJOCO_GL is '{value}', and gear renders without a window, through EGL or OSMesa;"
        " unset MUJOCO_GL, or set it to egl or osmesa"
    ]


def test_python_users_get_gears_own_error() -> None:
    done = run("bogus", "import gear\ntry:\n    gear.collect\nexcept gear.GearError as error:\n    print(error)")
    assert done.returncode == 0 and done.stdout.startswith("MUJOCO_GL is 'bogus'")


@pytest.mark.parametrize("value", ["EGL", " egl ", "OSMesa", "glfw", "disabled", ""])
def test_case_and_spaces_do_not_matter(value: str) -> None:
    code = "import os; from gear.values.mujoco_gl import check_mujoco_gl as c; c(); print(os.environ['MUJOCO_GL'])"
    done = run(value, code)
    assert done.returncode == 0 and done.stdout.strip() == value.strip().lower()
