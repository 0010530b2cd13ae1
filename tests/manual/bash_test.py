#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs bash's completion function on command lines, with Debian's bash-completion.

usage: bash_test.py SYMRIG MANUAL
"""

import pathlib
import subprocess
import sys
import tempfile

import help_lists
from help_lists import command_help

LIBRARY = pathlib.Path("/usr/share/bash-completion/bash_completion")

# Prints what the function offers for each line of standard input, one line each; the cursor is at the end of the line.
SCRIPT = r"""
. "$1"
. "$2"
while IFS= read -r COMP_LINE; do
  # As readline splits: at blanks, and before and after = and :.
  mapfile -t COMP_WORDS < <(printf '%s' "$COMP_LINE" | sed 's/[=:]/\n&\n/g; s/ /\n/g' | sed '/^$/d')
  [[ $COMP_LINE != *' ' && $COMP_LINE != *[=] ]] || COMP_WORDS+=('')
  COMP_CWORD=$((${#COMP_WORDS[@]} - 1)) COMP_POINT=${#COMP_LINE} COMP_TYPE=9 COMP_KEY=9 COMPREPLY=()
  compopt() { :; }
  _symrig symrig "${COMP_WORDS[COMP_CWORD]}" "${COMP_WORDS[COMP_CWORD - 1]}"
  echo "${COMPREPLY[*]}"
done
"""


def completed(lines, folder, script):
    done = subprocess.run(["bash", "--norc", "-c", SCRIPT, "bash", LIBRARY, script], input="".join(line + "\n" for line in lines),
                          capture_output=True, text=True, check=True, cwd=folder)  # fmt: skip
    assert not done.stderr, done.stderr
    offers = [set(line.split()) for line in done.stdout.splitlines()]
    assert len(offers) == len(lines), done.stdout
    return dict(zip(lines, offers))


def expected(symrig):
    """{line: the words that must be offered, all of them}."""
    known = help_lists.all_options(symrig)
    scenes = set(command_help.scenes(symrig))
    lights = set(command_help.lights(symrig))
    algorithms = set(command_help.algorithms(symrig))
    lines = {f"symrig {command} -": options for command, options in known.items() if command}
    lines.update({
        "symrig ": set(known) - {""} | known[""],
        "symrig cap": {"capture"},
        "symrig help e": {command for command in known if command.startswith("e")},
        "symrig capture --algorithm ": algorithms,
        "symrig capture --algorithm=": algorithms,
        "symrig capture --algorithm=br": {"brute"},
        "symrig capture --rig sim:": scenes,
        "symrig capture --rig=sim:vgroove-": {scene for scene in scenes if scene.startswith("vgroove-")},
        "symrig capture --max-patterns ": set(),
        "symrig capture --split views-": {"views-first", "views-last"},
        "symrig capture --check-axis --res": {"--resume"},
        "symrig relight scene.h5 --light let": {"letters"},
        "symrig relight scene.h5 --light ": lights | {"scene.h5", "other.txt", "folder"},
        "symrig relight --mosaic ": {"RGGB", "GRBG", "GBRG", "BGGR"},
        "symrig relight ": {"scene.h5", "folder"},
        "symrig relight --light white ": {"scene.h5", "folder"},
        "symrig relight scene.h5 --output ": {"scene.h5", "other.txt", "folder"},
        "symrig relight -o ": {"scene.h5", "other.txt", "folder"},
        "symrig calibrate --from ": {"folder"},
        "symrig bench --scenes plane,gum": {"plane,gummy"},
        "symrig bench --algorithms symrig,d": {"symrig,dual"},
        "symrig bench --noise o": {"off"},
        "symrig lint --board sim": {"sim:"},
        "symrig list ": known["list"],
        "symrig nonsense ": set(),
    })  # fmt: skip
    return lines


def main():
    if not LIBRARY.exists():
        print("bash-completion is not installed")
        sys.exit(77)
    symrig, manual = sys.argv[1], pathlib.Path(sys.argv[2]).resolve()
    lines = expected(symrig)
    with tempfile.TemporaryDirectory() as folder:
        for name in ("scene.h5", "other.txt"):
            (pathlib.Path(folder) / name).touch()
        (pathlib.Path(folder) / "folder").mkdir()
        offers = completed(lines, folder, manual / "symrig.bash")
    help_lists.finish([f"'{line}': offers {sorted(offers[line])}, not {sorted(lines[line])}" for line in lines if offers[line] != lines[line]])


if __name__ == "__main__":
    main()
