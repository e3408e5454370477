"""The commands work from anywhere, and say what they take."""

import subprocess
from pathlib import Path

import pytest

SCRIPTS = Path(__file__).resolve().parents[2] / "scripts"


@pytest.mark.parametrize("name", ["experiment", "evaluate", "bench"])
def test_help(name, tmp_path):
    done = subprocess.run(
        [SCRIPTS / name, "--help"], cwd=tmp_path, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    assert f"usage: {name}" in done.stdout


@pytest.mark.parametrize("name", ["experiment", "evaluate", "bench"])
def test_an_unknown_option_is_an_error(name):
    done = subprocess.run([SCRIPTS / name, "--nonsense"], capture_output=True, text=True, timeout=300)
    assert done.returncode == 2
    assert "usage" in done.stderr
