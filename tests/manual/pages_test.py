#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Every command has a manual page with its options, as the help has them; man prints each page without a warning.

usage: pages_test.py PROGRAM MANUAL
"""

import pathlib
import re
import shutil
import subprocess
import sys

import help_lists
from help_lists import command_help


def option_rows(page):
    """The options of the section OPTIONS: the bold names after each .TP."""
    section = re.search(r"^\.SH OPTIONS\n(.*?)^\.SH", page, re.MULTILINE | re.DOTALL)[1].replace("\\-", "-")
    return {name for row in re.findall(r"^\.TP\n(.*)$", section, re.MULTILINE) for name in re.findall(r"\\fB(-[\w-]+)\\fR", row)}


def warnings(page):
    printed = subprocess.run(["man", "--warnings", "-E", "UTF-8", "-l", "-Tutf8", page], capture_output=True, text=True, check=False)
    return printed.stderr.strip()


def main():
    path, manual = sys.argv[1], pathlib.Path(sys.argv[2]) / "man1"
    program = pathlib.Path(path).name
    faults = []
    known = help_lists.all_options(path, fewest=20 if program == "symrig" else 3)
    names = {program + (f"-{command}" if command else "") for command in known}
    pages = {path.stem for path in manual.glob("*.1")}
    if names != pages:
        faults.append(f"commands and pages differ by {sorted(names ^ pages)}")
    for command, options in known.items():
        page = manual / (program + (f"-{command}" if command else "") + ".1")
        text = page.read_text(encoding="utf-8")
        if option_rows(text) != options:
            faults.append(f"{page.name}: options differ from the help by {sorted(option_rows(text) ^ options)}")
        if "EXIT STATUS" not in text or ".SH EXAMPLES" not in text:
            faults.append(f"{page.name}: no exit status or no example")
        if shutil.which("man") and warnings(page):
            faults.append(f"{page.name}: {warnings(page)}")
    overview = (manual / f"{program}.1").read_text(encoding="utf-8").replace("\\-", "-")
    faults += [f"{program}.1: no command {command}" for command in known if command and f"\\fB{program}-{command}\\fR(1)\n" not in overview]
    if "capture" in known:
        capture = (manual / f"{program}-capture.1").read_text(encoding="utf-8").replace("\\-", "-")
        faults += [f"{program}-capture.1: no scene {scene}" for scene in command_help.scenes(path) if f"\\fB{scene}\\fR" not in capture]
    help_lists.finish(faults)


if __name__ == "__main__":
    main()
