#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A board that was just flashed through its drive passes the self-test at once: the real command, the emulated board and its drive.

usage: flash_selftest_test.py SYMRIG NODE SERVER UF2     exit 77: something is missing
"""

import json
import pathlib
import subprocess
import sys
import tempfile


def symrig(command, *words):
    done = subprocess.run([command, *words], capture_output=True, text=True, timeout=500, check=False)
    assert done.returncode == 0, f"symrig {' '.join(words)}: exit {done.returncode}\n{done.stdout}{done.stderr}"
    return done.stdout


def check(command, device, uf2, folder):
    drive = str(folder / "drive")
    told = symrig(command, "flash", uf2, "--device", device, "--drive", drive, "--again", "--wait", "120")
    assert "the same as the file" in told, told
    test = json.loads(symrig(command, "selftest", "--device", device, "--pings", "3", "--json", "-"))
    states = {check["name"]: check for check in test["checks"]}
    assert test["passed"] and all(one["passed"] for one in states.values()), test
    assert "started by request" in states["state"]["text"], states["state"]
    assert "fault" not in states["state"]["text"], states["state"]
    print(f"flashed, then: {states['state']['text']}; {len(states)} checks passed")


def main():
    command, node, server, uf2 = sys.argv[1:]
    modules = pathlib.Path(server).parent.parent / "node_modules/rp2040js"
    for needed in (pathlib.Path(node), modules, pathlib.Path(uf2)):
        if not needed.exists():
            print(f"skipped: {needed} is missing (tools/setup, tools/firmware)")
            return 77
    with tempfile.TemporaryDirectory(prefix="symrig-flash-") as name:
        folder = pathlib.Path(name)
        words = [node, server, "--uf2", uf2, "--unix", str(folder / "board"), "--drive", str(folder / "drive")]
        with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as emulator:
            try:
                ready = emulator.stdout.readline().split()
                assert ready[:1] == ["ready"], ready
                check(command, ready[1], uf2, folder)
            finally:
                emulator.terminate()
    return 0


if __name__ == "__main__":
    sys.exit(main())
