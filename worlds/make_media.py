#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draw every texture and mesh of the simulator: make_media.py DIRECTORY."""

import sys
from pathlib import Path

import citadel
import drone_media
import ground_media
import husky_media
import obstacle_media


def main():
    """Write all media into the directory that is the only argument."""
    if len(sys.argv) != 2:
        sys.exit("usage: make_media.py DIRECTORY")
    directory = Path(sys.argv[1])
    directory.mkdir(parents=True, exist_ok=True)
    for module in (ground_media, obstacle_media, husky_media, drone_media):
        module.write(directory)
    citadel.write_media(directory)


if __name__ == "__main__":
    main()
