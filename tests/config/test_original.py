"""CARLA-GeAR's own configs."""

from __future__ import annotations

from pathlib import Path

import pytest

from gear.config.collection import SplitConfig
from gear.config.load import load_simulation
from gear.values.errors import ConfigError


def test_the_original_simulation_config_is_read_and_never_run(tmp_path: Path) -> None:
    trap = tmp_path / "trap"
    file = tmp_path / "simulation_configs.py"
    file.write_text(
        "import os\n"
        f"open({str(trap)!r}, 'w').close()\n"
        "SEED_VALUES = {'test': 5, 'video': 6}\nITERATION_VALUES = {'test': 7, 'video': 1}\nMAX_VEHICLE_NPC = 3\n"
        "def f():\n    return 1\n"
    )
    simulation = load_simulation(str(file))
    assert simulation.splits == {
        "test": SplitConfig(seed=5, samples=7),
        "video": SplitConfig(seed=6, samples=1, frames=105),
    }
    assert simulation.max_vehicles == 3
    assert not trap.exists()
    file.write_text("SEED_VALUES = dict(test=5)\nITERATION_VALUES = {'test': 7}\n")
    with pytest.raises(ConfigError, match=r"simulation_configs.py:1:1: SEED_VALUES: is computed.*write it as YAML"):
        load_simulation(str(file))


def test_mistakes_in_the_original_simulation_config_stand_in_its_own_lines(tmp_path: Path) -> None:
    file, trap = tmp_path / "sim.py", tmp_path / "trap"
    seeds = "# seeds\n\nSEED_VALUES: dict = {'val': 131}\nITERATION_VALUES = {\n"
    file.write_text(f"{seeds}  'val': 5,\n}}\n")
    assert load_simulation(str(file)).splits == {"val": SplitConfig(seed=131, samples=5)}
    for value, message in (
        ("-4", r"sim.py:5:10: splits.val.samples: must be 1 to 1000000, got -4"),
        ("'a: b'", r"sim.py:5:10: splits.val.samples: expected int, got 'a: b'"),
        ("None", r"sim.py:5:10: splits.val.samples: expected int, got 'None'"),
        ("{'a': 1}", r"sim.py:5:10: splits.val.samples: expected int, got keys and values"),
        (f"open({str(trap)!r}, 'w')", r"sim.py:4:1: ITERATION_VALUES: is computed"),
        ("[" * 5000, r"sim.py:5:\d+: is not Python|sim.py: is not Python"),
    ):
        file.write_text(f"{seeds}  'val': {value},\n}}\n")
        with pytest.raises(ConfigError, match=message):
            load_simulation(str(file))
    assert not trap.exists()
    file.write_text("SEED_VALUES: dict\nITERATION_VALUES = {'val': 5}\n")
    with pytest.raises(ConfigError, match="has no SEED_VALUES"):
        load_simulation(str(file))


@pytest.mark.parametrize(
    ("more", "where"),
    [
        ("ITERATION_VALUES['test'] = 10", "3:1: ITERATION_VALUES"),
        ("ITERATION_VALUES['test'] += 10", "3:1: ITERATION_VALUES"),
        ("del SEED_VALUES['test']", "3:5: SEED_VALUES"),
        ("ITERATION_VALUES.update(test=10)", "3:1: ITERATION_VALUES"),
        ("ITERATION_VALUES |= {'test': 10}", "3:1: ITERATION_VALUES"),
        ("if True:\n    ITERATION_VALUES = {'test': 10}", "4:5: ITERATION_VALUES"),
        ("X = ITERATION_VALUES = {'test': 10}", "3:5: ITERATION_VALUES"),
        ("ITERATION_VALUES = X = {'test': 10}", "3:1: ITERATION_VALUES"),
        ("X, SEED_VALUES = 1, {'test': 10}", "3:4: SEED_VALUES"),
        ("X = ITERATION_VALUES\nX['test'] = 10", "3:5: ITERATION_VALUES"),
        ("dict.update(ITERATION_VALUES, test=10)", "3:13: ITERATION_VALUES"),
        ("halve(ITERATION_VALUES)", "3:7: ITERATION_VALUES"),
        ("for MAX_VEHICLE_NPC in (1, 2):\n    pass", "3:5: MAX_VEHICLE_NPC"),
        ("from others import counts as ITERATION_VALUES", "3:20: ITERATION_VALUES"),
    ],
)
def test_an_original_simulation_config_that_changes_what_it_says_is_refused(
    tmp_path: Path, more: str, where: str
) -> None:
    """Counts would be others than CARLA-GeAR's, and nobody would be told."""
    file = tmp_path / "sim.py"
    file.write_text(f"SEED_VALUES = {{'test': 5}}\nITERATION_VALUES = {{'test': 50}}\n{more}\n")
    with pytest.raises(ConfigError, match=f"sim.py:{where}: is computed.*write it as YAML"):
        load_simulation(str(file))


def test_an_original_simulation_config_may_look_at_what_it_says(tmp_path: Path) -> None:
    file = tmp_path / "sim.py"
    file.write_text(
        "SEED_VALUES: dict\nSEED_VALUES = {'test': 5}\nITERATION_VALUES = {'test': 4}\n"
        "ITERATION_VALUES = {'test': 50}\nMAX_VEHICLE_NPC = 3\nN = ITERATION_VALUES['test']\n"
        "print(SEED_VALUES, f'{ITERATION_VALUES}', MAX_VEHICLE_NPC)\n"
        "for split in SEED_VALUES:\n    assert split in ITERATION_VALUES and ITERATION_VALUES.get(split)\n"
        "MORE = ITERATION_VALUES | {'test': 7}\nMOST = [2 * n for n in ITERATION_VALUES.values()] + [MAX_VEHICLE_NPC]\n"
    )
    simulation = load_simulation(str(file))
    assert simulation.splits == {"test": SplitConfig(seed=5, samples=50)} and simulation.max_vehicles == 3
