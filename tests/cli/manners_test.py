#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Colours only where they are wanted, and a program on standard input.

usage: manners_test.py SYMRIG
"""

import os
import pathlib
import pty
import subprocess
import sys
import tempfile

SYMRIG = str(pathlib.Path(sys.argv[1]).resolve())
EXAMPLES = pathlib.Path(__file__).resolve().parent.parent.parent / "examples/programs"
RED, CYAN, PLAIN = "\x1b[1;31m", "\x1b[1;36m", "\x1b[0m"


def environment(**changed):
    kept = {name: value for name, value in os.environ.items() if name not in ("NO_COLOR", "TERM")}
    return {**kept, "TERM": "xterm", **changed}


def on_terminal(*words, **changed):
    """Standard output and error as one terminal sees them."""
    ours, theirs = pty.openpty()
    child = subprocess.Popen([SYMRIG, *words], stdin=subprocess.DEVNULL, stdout=theirs, stderr=theirs, env=environment(**changed))
    os.close(theirs)
    shown = b""
    while True:
        try:
            part = os.read(ours, 65536)
        except OSError:  # the other end is closed
            part = b""
        if not part:
            break
        shown += part
    child.wait()
    os.close(ours)
    return shown.decode().replace("\r\n", "\n")


def piped(*words, text="", cwd=None, **changed):
    return subprocess.run([SYMRIG, *words], input=text, capture_output=True, text=True, check=False, cwd=cwd, env=environment(**changed))


def test_errors_are_red_on_a_terminal():
    assert on_terminal("inspect", "none.h5").startswith(f"{RED}symrig inspect:{PLAIN} none.h5: "), on_terminal("inspect", "none.h5")


def test_no_colours_where_nobody_wants_them():
    for changed in ({"NO_COLOR": "1"}, {"TERM": "dumb"}, {"TERM": ""}):
        assert "\x1b" not in on_terminal("inspect", "none.h5", **changed), changed
    assert RED in on_terminal("inspect", "none.h5", NO_COLOR="")  # set but empty: as if it were not set
    failed = piped("inspect", "none.h5")
    assert failed.stderr.startswith("symrig inspect: none.h5") and "\x1b" not in failed.stderr, failed.stderr


def test_findings_have_the_colour_of_their_severity():
    program = str(EXAMPLES / "hdr-scan.toml")
    shown = on_terminal("lint", program)
    assert f": {CYAN}note:{PLAIN} profile.assumption: " in shown, shown
    assert shown.replace(CYAN, "").replace(PLAIN, "") == piped("lint", program).stdout
    assert "\x1b" not in on_terminal("lint", program, NO_COLOR="1")


def test_lint_reads_standard_input():
    text = (EXAMPLES / "hdr-scan.toml").read_text(encoding="utf-8")
    from_file, typed = piped("lint", "hdr-scan.toml", cwd=EXAMPLES), piped("lint", "-", text=text, cwd=EXAMPLES)
    assert typed.returncode == 0 and typed.stdout == from_file.stdout.replace("hdr-scan.toml:", "-:"), typed
    broken = piped("lint", "-", text="symrig = 1\n")
    assert broken.returncode == 4 and broken.stderr.startswith("symrig lint: -:1: program is missing"), broken
    closed = subprocess.run([SYMRIG, "lint", "-"], stdin=None, capture_output=True, text=True, check=False, preexec_fn=lambda: os.close(0))
    assert closed.returncode == 4 and closed.stderr.startswith("symrig lint: standard input: "), closed


def test_standard_input_protects_the_files_that_it_names():
    with tempfile.TemporaryDirectory() as folder:
        profile = pathlib.Path(folder) / "camera.toml"
        profile.write_text("precious", encoding="utf-8")
        text = 'symrig = 1\n[rig]\ncamera = "camera.toml"\n[program]\npatterns = 1\nbracket = ["1 ms"]\n'
        refused = piped("lint", "-", "--json", "camera.toml", text=text, cwd=folder)
        assert refused.returncode == 2 and "is the same file" in refused.stderr, refused
        assert profile.read_text(encoding="utf-8") == "precious"
        # A file of this name is ./-, as everywhere.
        (pathlib.Path(folder) / "-").write_text("symrig = 1\n", encoding="utf-8")
        named = piped("lint", "./-", cwd=folder)
        assert named.returncode == 4 and "./-:1: program is missing" in named.stderr, named


def main():
    tests = [value for name, value in sorted(globals().items()) if name.startswith("test_")]
    for test in tests:
        test()
    print(f"{len(tests)} tests passed")


if __name__ == "__main__":
    main()
