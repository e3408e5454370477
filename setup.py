"""Python package, for catkin_python_setup."""

from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(
    **generate_distutils_setup(
        packages=[
            "tld_follower",
            "tld_follower.evaluation",
            "tld_follower.evaluation.bench",
            "tld_follower.following",
            "tld_follower.nodes",
            "tld_follower.tld",
        ],
        package_dir={"": "src"},
    )
)
