# SPDX-License-Identifier: BSD-3-Clause
"""The worlds that scripts write are those in the package."""

import subprocess
import sys
from pathlib import Path

WORLDS = Path(__file__).resolve().parents[3] / "worlds"


def test_scripts_write_the_worlds_that_are_there(tmp_path):
    subprocess.run([sys.executable, "-B", WORLDS / "make_worlds.py", tmp_path], check=True)
    written = sorted(tmp_path.iterdir())
    assert [file.name for file in written] == ["citadel.world", "corridor.world"]
    for file in written:
        assert file.read_text() == (WORLDS / file.name).read_text(), (
            f"run worlds/make_worlds.py for {file.name}"
        )
