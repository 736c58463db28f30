"""MuJoCo's complaints name the file that is broken."""

from __future__ import annotations

from pathlib import Path

from gear.world.compilation.mujoco_errors import compile_error, compile_problem, without_breaks

GOOD = "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>"
BAD = "<mujoco><worldbody><geom\nsize='-1'/></worldbody></mujoco>"


def test_the_first_broken_file_is_named(tmp_path: Path) -> None:
    good, bad = tmp_path / "good.xml", tmp_path / "bad.xml"
    good.write_text(GOOD)
    bad.write_text(BAD)
    assert compile_problem(good) == "" and compile_problem(bad)
    error = compile_error(ValueError("of the whole"), [good, bad])
    assert str(bad) in str(error) and "of the whole" not in str(error) and "\n" not in str(error)


def test_lines_of_a_composed_text_are_left_out(tmp_path: Path) -> None:
    good = tmp_path / "good.xml"
    good.write_text(GOOD)
    error = compile_error(ValueError("repeated name 'a', line 77\nin geom"), [good])
    assert "repeated name 'a' in geom" in str(error) and "77" not in str(error)
    assert without_breaks(ValueError("a\n  b")) == "a b"
