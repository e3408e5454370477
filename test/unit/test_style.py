"""The code is formatted and linted, algorithms know no ROS, and the package is well-formed."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def run(*command):
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("arguments", [["check"], ["format", "--check"]], ids=["check", "format"])
def test_python_by_ruff(arguments):
    done = run(sys.executable, "-m", "ruff", *arguments, ".")
    assert done.returncode == 0, done.stdout + done.stderr


def test_cpp_by_clang_format():
    files = sorted(path for suffix in ("cpp", "h") for path in ROOT.glob(f"src/**/*.{suffix}"))
    files += sorted(ROOT.glob("test/**/*.cpp"))
    done = run("clang-format", "--dry-run", "--Werror", *files)
    assert done.returncode == 0, done.stderr[-3000:]


def test_package_by_catkin_lint():
    done = run("catkin_lint", "-q", ".")
    assert done.returncode == 0, done.stdout + done.stderr


def imports(path):
    """Every module that a Python file imports."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module or ""


@pytest.mark.parametrize(
    ("folder", "foreign"),
    [("tld", "following|ardrone|nodes|evaluation"), ("following", "tld|ardrone|nodes|evaluation")],
)
def test_imports_point_one_way(folder, foreign):
    for path in (ROOT / "src" / "tld_follower" / folder).glob("*.py"):
        for module in imports(path):
            assert not re.match(rf"tld_follower\.({foreign})\b", module), f"{path.name} imports {module}"
            assert not re.match(r"(rospy|roslib|cv_bridge|rosbag|\w+_msgs)\b", module), (
                f"{path.name} imports {module}"
            )


def test_only_nodes_include_ros():
    for path in ROOT.glob("src/s*/*"):
        if path.suffix in (".cpp", ".h") and "_node." not in path.name and path.name != "main.cpp":
            assert not re.search(r"#include [<\"](ros/|\w+_msgs/)", path.read_text()), path.name
