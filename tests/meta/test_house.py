"""What holds everywhere in gear."""

from __future__ import annotations

import ast
import re
import statistics
import subprocess
import sys
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MODULES = sorted((ROOT / "gear").rglob("*.py"))
NAMES = [".".join(p.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__") for p in MODULES]
TORCH_ROOMS = ("gear.camera.torch_response",)


def test_modules_stay_small() -> None:
    lines = {p: len(p.read_text().splitlines()) for p in MODULES}
    assert not {str(p): n for p, n in lines.items() if n > 500}
    assert statistics.median(n for n in lines.values() if n > 5) < 120


def test_folders_stay_small() -> None:
    """At most 25 modules in a folder, so that its contents can be taken in at a glance."""
    names = [path.parent.relative_to(ROOT) for path in MODULES if path.name != "__init__.py"]
    assert {str(folder): names.count(folder) for folder in set(names) if names.count(folder) > 25} == {}


def test_only_one_module_makes_generators() -> None:
    makers = [p for p in MODULES if re.search(r"default_rng\(|np\.random\.(seed|rand|normal|choice)\(", p.read_text())]
    assert [p.relative_to(ROOT / "gear").as_posix() for p in makers] == ["values/rng.py"]


def test_the_library_never_prints() -> None:
    guilty = [
        p.relative_to(ROOT).as_posix()
        for p in MODULES
        if "cli" not in p.parts
        and any(
            isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "print"
            for node in ast.walk(ast.parse(p.read_text()))
        )
    ]
    assert guilty == []


def test_public_names_are_documented() -> None:
    bare = []
    for path in MODULES:
        tree = ast.parse(path.read_text())
        if path.name != "__init__.py" and ast.get_docstring(tree) is None:
            bare.append(f"{path.relative_to(ROOT)}")
        for node in tree.body:
            is_public = isinstance(node, (ast.FunctionDef, ast.ClassDef)) and not node.name.startswith("_")
            if is_public and ast.get_docstring(node) is None:
                bare.append(f"{path.relative_to(ROOT)}:{node.lineno} {node.name}")
    assert bare == []


def test_nothing_names_a_machine() -> None:
    """Without git, which neither a bare system nor an unpacked archive has; folders with a dot are tools' caches."""
    ours = [p for p in ROOT.iterdir() if (p.is_file() and p.name != ".git") or p.name == ".ci"]
    ours += [ROOT / name for name in ("authoring", "benchmarks", "configs", "docs", "examples", "gear", "mjcf")]
    ours += [ROOT / name for name in ("tests", "weights")]
    files = [p for top in ours for p in (top.rglob("*") if top.is_dir() else [top]) if p.is_file()]
    files = [p for p in files if not any(part.startswith(".") for part in p.parent.relative_to(ROOT).parts[1:])]
    texts = [p for p in files if p.suffix in {".py", ".md", ".yml", ".toml", ".xml", ".cff", ".template", ""}]
    assert len(texts) > 800
    guilty = [
        str(p.relative_to(ROOT))
        for p in texts
        if re.search(r"(?<!\w)/(work|root|tmp)/[a-z]", p.read_text(errors="ignore"))
    ]
    assert [name for name in guilty if name != "tests/meta/test_house.py"] == []


def test_every_module_can_be_imported_first() -> None:
    """Imports at the top of modules have no cycle, so that no module needs another to be imported before it."""
    graph = {name: _imported_at_the_top(name) for name in NAMES}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


def _imported_at_the_top(name: str) -> set[str]:
    """The modules of gear that `name` imports when it is imported, and the packages of these modules.

    Not the packages of `name` itself, which Python has begun to import when it comes to `name`.
    """
    path = ROOT.joinpath(*name.split("."))
    file = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    found: set[str] = set()
    for node in ast.parse(file.read_text()).body:
        if isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
    packages = {module.rsplit(".", n)[0] for module in found for n in range(1, module.count(".") + 1)}
    return {module for module in found | packages if module in NAMES and not f"{name}.".startswith(f"{module}.")}


@pytest.mark.slow
def test_every_module_imports_without_a_warning() -> None:
    code = "import importlib, sys, warnings, cv2, mujoco, numpy, pluggy, scipy.optimize, torch, yaml\n"
    code += "warnings.simplefilter('error')\n[importlib.import_module(name) for name in sys.argv[1:]]"
    done = subprocess.run([sys.executable, "-c", code, *NAMES], capture_output=True, text=True, cwd=ROOT, check=False)
    assert done.returncode == 0, done.stderr


def test_help_is_quick_because_it_imports_next_to_nothing() -> None:
    code = (
        "import sys; from gear.cli.main import main\n"
        "try:\n    main(['--help'])\nexcept SystemExit:\n    pass\n"
        "print(sorted({'numpy', 'mujoco', 'torch', 'cv2', 'dm_control', 'yaml', 'pluggy'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip().endswith("[]")


def test_collecting_never_imports_torch() -> None:
    code = (
        "import sys; import gear.cli.commands.collect, gear.verbs.collect.run, gear.collecting.session\n"
        "from gear.plugins.manager import catalogue; catalogue()\n"
        "sys.exit('torch' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
