# SPDX-License-Identifier: Apache-2.0
"""A build without manual pages installs every file that debian/*.install names, or a nodoc build of the packages would end with an error.

usage: nodoc_test.py
It only configures: what would be installed stands in the cmake_install.cmake of each folder.
"""

import fnmatch
import os
import pathlib
import re
import subprocess
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
# Packages of parts that a build leaves out where their libraries are missing.
OPTIONAL = {"python3-symrig": "SYMRIG_PYTHON", "symrig-board-linux": "SYMRIG_BOARD_LINUX", "symrig-mpi": "SYMRIG_MPI"}
RULE = re.compile(r'file\(INSTALL DESTINATION "\$\{CMAKE_INSTALL_PREFIX\}/([^"]*)" TYPE ([^)]*)\)')


def configure(build):
    options = ["MANUAL=OFF", "BUILD_TESTS=OFF", "BUILD_BENCHMARKS=OFF", "PYTHON_DIR=lib/python3/dist-packages"]
    words = ["cmake", "-S", ROOT, "-B", build, "-DCMAKE_INSTALL_PREFIX=/usr", *(f"-DSYMRIG_{option}" for option in options)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return (pathlib.Path(build) / "CMakeCache.txt").read_text()


def installed(build):
    """Paths below the root, such as usr/bin/symrig."""
    for script in pathlib.Path(build).rglob("cmake_install.cmake"):
        for folder, rest in RULE.findall(script.read_text()):
            if "OPTIONAL" in rest:
                continue
            rename = re.search(r'RENAME "([^"]+)"', rest)
            for file in re.findall(r'"(/[^"]+)"', rest[rest.index("FILES") :]):
                yield f"usr/{folder}/{rename[1] if rename else os.path.basename(file)}"


def is_there(pattern, paths):
    return any(fnmatch.fnmatch(path, pattern) or fnmatch.fnmatch(path, pattern + "/*") for path in paths)


def main():
    with tempfile.TemporaryDirectory() as build:
        cache, paths = configure(build), sorted(installed(build))
    assert is_there("usr/bin/symrig", paths) and not is_there("usr/share/man/man1", paths), paths
    seen = 0
    for names in sorted((ROOT / "debian").glob("*.install")):
        option = OPTIONAL.get(names.stem)
        if option and not re.search(rf"^{option}:BOOL=(ON|TRUE|1)$", cache, re.MULTILINE):
            continue
        for line in names.read_text().splitlines():
            pattern = line.split()[0]
            if not pattern.startswith("debian/"):
                assert is_there(pattern, paths), f"{names.name}: nothing installs {pattern} without manual pages"
                seen += 1
    assert seen >= 9, seen


main()
