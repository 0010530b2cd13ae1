# SPDX-License-Identifier: Apache-2.0
"""The lists that the command prints from its tables: commands, options, scenes, keys, algorithms, lights, profiles, drivers."""

import pathlib
import re
import subprocess
import tempfile

HEAD = "symrig = 1\n"  # of a program or rig file
RIG = HEAD + '[board]\nuri = "sim:"\n'
CAMERA = "[camera]\nbits = 12\nfull_well = 9000\nread_noise = 1\npedestal = 1\n"


def run(symrig, *words, cwd=None):
    return subprocess.run([symrig, *words], capture_output=True, text=True, check=False, cwd=cwd)


def help_of(symrig, *command):
    return run(symrig, *command, "--help").stdout


def rows(text, heading):
    """{name: text} of the lines "  name  text" below a line of the help; a line that goes on is not read."""
    block = re.search(rf"^{re.escape(heading)}\n((?:  .*\n)+)", text, re.MULTILINE)
    return dict(re.findall(r"^  (\S+) +(.+)$", block[1], re.MULTILINE)) if block else {}


def commands(symrig):
    return rows(help_of(symrig), "Subcommands:")


def options(symrig, *command):
    """Long and short names."""
    named = re.findall(r"^  ((?:-\w,)?--[a-z][a-z-]*(?:,--[a-z][a-z-]*)*)", help_of(symrig, *command), re.MULTILINE)
    return {name for names in named for name in names.split(",")}


def scenes(symrig):
    return rows(help_of(symrig, "capture"), "Scenes:")


def scene_keys(symrig):
    """{key: the values that it takes}."""
    lines = rows(help_of(symrig, "capture"), "Keys of a simulated rig, with their defaults:")
    return {name.split("=")[0]: text[text.rindex(" (") + 2 : -1] for name, text in lines.items()}


def algorithms(symrig):
    return rows(help_of(symrig, "capture"), "Algorithms:")


def lights(symrig):
    return rows(help_of(symrig, "relight"), "Or IMAGE is a built-in light:")


def names_known(symrig, file):
    """The names that an error lists for a file with one unknown name. A file with a board is a rig file."""
    with tempfile.TemporaryDirectory() as folder:
        (pathlib.Path(folder) / "x.toml").write_text(file, encoding="utf-8")
        words = ["capture", "--rig", "x.toml", "-o", "x.h5"] if "[board]" in file else ["lint", "x.toml"]
        error = run(symrig, *words, cwd=folder).stderr
    listed = re.search(r"(?:known|legal): ([^;\n]+)", error)
    return [name.strip('"') for name in listed[1].strip().split(", ")] if listed else []


def profiles(symrig):
    return names_known(symrig, HEAD + "[rig]\ncamera = 'zzz'\n")


def camera_drivers(symrig):
    return names_known(symrig, RIG + CAMERA + "driver = 'zzz'\n")


def projector_drivers(symrig):
    return names_known(symrig, RIG + CAMERA + "[projector]\ndriver = 'zzz'\n")
