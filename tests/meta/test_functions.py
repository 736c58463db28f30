"""Functions stay short and take few parameters; the public verbs, whose keywords are their documentation, may not."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import gear

ROOT = Path(__file__).parents[2]
MOST_LINES, MOST_PARAMETERS = 80, 7


def functions(text: str) -> Iterator[ast.FunctionDef]:
    """Every function and method of a module's source."""
    return (node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.FunctionDef))


def lines_of(function: ast.FunctionDef) -> int:
    """From `def` to the last line, the docstring included."""
    assert function.end_lineno is not None
    return function.end_lineno - function.lineno + 1


def parameters_of(function: ast.FunctionDef) -> int:
    """Without `self` and `cls`."""
    arguments = function.args
    named = [one.arg for one in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs)]
    return len([name for name in named if name not in ("self", "cls")])


def too_large(text: str) -> list[str]:
    """Names of the functions that are too long or take too many parameters."""
    return [one.name for one in functions(text) if lines_of(one) > MOST_LINES or parameters_of(one) > MOST_PARAMETERS]


def test_only_public_verbs_are_large() -> None:
    public = {f"{value.__module__}.{name}" for name in gear.__all__ if callable(value := getattr(gear, name))}
    guilty = []
    for path in sorted((ROOT / "gear").rglob("*.py")):
        module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        guilty += [f"{module}.{name}" for name in too_large(path.read_text()) if f"{module}.{name}" not in public]
    assert not guilty


def test_a_large_function_is_found() -> None:
    assert too_large("def f(a, b, c, d, e, *, g, h, i): ...") == ["f"]
    assert too_large("class A:\n    def f(self, a, b, c, d, e, g, h): ...") == []
    assert too_large("def f():\n" + "    x = 1\n" * 80) == ["f"]
    assert too_large("def f():\n" + "    x = 1\n" * 79) == []
