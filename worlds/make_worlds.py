#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Write the worlds that are made by scripts: make_worlds.py [DIRECTORY], this folder if none is given."""

import sys
from pathlib import Path

import citadel
import corridor


def main():
    """Write every world into the directory."""
    directory = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    for module in (citadel, corridor):
        module.write(directory)


if __name__ == "__main__":
    main()
