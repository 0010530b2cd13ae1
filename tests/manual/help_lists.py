# SPDX-License-Identifier: Apache-2.0
"""What the help lists: the yardstick for manual pages and completions."""

import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent.parent / "tools"))
import command_help  # noqa: E402


def options(help_text):
    """Long and short names of the options: {"-h", "--help", ...}."""
    names = set()
    for line in re.findall(r"^  (-[\w,-]+)", help_text, re.MULTILINE):
        names |= set(line.split(","))
    return names


def all_options(symrig, fewest=20):
    """{command: options}; the command "" is the program itself. fewest: commands that it has."""
    known = {"": options(command_help.help_of(symrig))}
    for command in command_help.commands(symrig):
        known[command] = options(command_help.help_of(symrig, command))
    assert len(known) > fewest and all(known.values()), known
    return known


def finish(faults):
    print("\n".join(faults) if faults else "no faults")
    sys.exit(1 if faults else 0)
