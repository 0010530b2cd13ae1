#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The manual page of symrigd, which is written by hand, has the options and the exit codes of its help, and no others.

usage: daemon_test.py SYMRIGD
"""

import pathlib
import re
import subprocess
import sys

import help_lists

PAGE = pathlib.Path(__file__).resolve().parent.parent.parent / "boards/linux/system/symrigd.8"


def main():
    text = subprocess.run([sys.argv[1], "--help"], capture_output=True, text=True, check=True).stdout
    page = PAGE.read_text(encoding="utf-8").replace("\\-", "-")
    wanted = help_lists.options(text)
    found = set(re.findall(r"\\fB(--?[a-zA-Z][\w-]*)\\fR", re.search(r"^\.SH OPTIONS\n(.*?)^\.SH", page, re.MULTILINE | re.DOTALL)[1]))
    faults = [] if wanted == found and len(wanted) > 4 else [f"symrigd.8: options differ from the help by {sorted(wanted ^ found)}"]
    codes = re.findall(r"(\d) [a-z]", re.search(r"Exit codes: (.*)", text)[1])
    faults += [f"symrigd.8: no exit code {code}" for code in codes if f".TP\n\\fB{code}\\fR" not in page]
    help_lists.finish(faults)


if __name__ == "__main__":
    main()
