"""Without dm-control, which Python 3.13's pip cannot install by itself, a command says what to type."""

from __future__ import annotations

import subprocess
import sys

from gear.world.compilation.quiet_mjcf import mjcf


def test_towns_are_composed_with_dm_control() -> None:
    root = mjcf.RootElement(model="town")
    root.worldbody.add("geom", name="ground", type="plane", size=(1, 1, 1))
    assert 'name="ground"' in root.to_xml_string()


def test_without_dm_control_one_line_says_how_to_install_it() -> None:
    code = (
        "import sys; sys.modules['dm_control'] = None\n"
        "from gear.cli.main import main\n"
        "sys.exit(main(['collect', '--task', 'depth', '--samples', '1', '--out', '/nonexistent/gear']))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.splitlines() == [
        "gear: towns are composed with dm-control, which is not installed: pip install --no-deps dm-control"
    ]
