# SPDX-License-Identifier: Apache-2.0
"""kill -9 at many moments, then --resume: scene.h5 holds the same bits as that of a capture left alone.

usage: resume_test.py SYMRIG
Exit code 77: h5py is not installed.
"""

import json
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

from scene_content import content

TICK_SECONDS = 8e-9  # where a session begins may move a wait for the projector by a tick of the board
REFRESH_SECONDS = 1 / 60  # where exposures are planned, a run begins at the refresh that the one before it left
CAPTURES = (
    ("sim:vgroove-textured?size=40x52&drift=0.05&dead=0.01&exposures=4", "symrig", TICK_SECONDS),
    ("sim:vgroove-textured?size=40x52&drift=0.05&dead=0.01", "symrig", REFRESH_SECONDS),
    ("sim:gummy?size=24x31&channels=3&exposures=4", "dual", TICK_SECONDS),
)
# A camera finer than the cells: the log keeps what it saw, and the rig is compared with its registration on the way.
BENCH = "sim:gummy?size=16x17&fine=2&camera=76x80&zoom=0.8&turn=1"
KILLS = (0.0, 0.0, 0.05, 0.3, 0.31, 0.6, 0.95)  # shares of the whole log


def kill_when(log, size, command):
    """Starts the command, and kills it once its log has `size` bytes. Whether it had finished before."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    while process.poll() is None:
        if log.exists() and log.stat().st_size >= size:
            process.send_signal(signal.SIGKILL)
        time.sleep(0.0005)
    assert process.returncode in (0, -signal.SIGKILL), process.returncode
    return process.returncode == 0


def check(symrig, folder, rig, algorithm, apart, *options):
    def command(name, *more):
        output = str(folder / f"{name}.h5")
        json_file = str(folder / f"{name}.json")
        return [symrig, "capture", "--rig", rig, "--algorithm", algorithm, "-o", output, "--json", json_file, *options, *more]

    subprocess.run(command("whole", "--keep-log"), check=True, stdout=subprocess.DEVNULL)
    log = folder / "killed.h5.log"
    size = (folder / "whole.h5.log").stat().st_size
    killed = 0
    for share in KILLS:
        killed += not kill_when(log, share * size, command("killed", "--resume", "--keep-log"))
        kept = log.stat().st_size
        assert kept <= size and kept >= share * size - size / 50, (share, kept, size)
    assert killed >= len(KILLS) - 2, killed  # the last kills may come after the end
    subprocess.run(command("killed", "--resume", "--keep-log"), check=True, stdout=subprocess.DEVNULL)
    whole, resumed = (json.loads((folder / f"{name}.json").read_text()) for name in ("whole", "killed"))
    print(f"{rig} {algorithm}: killed {killed} times, {resumed['replayed']} of {resumed['patterns']} photographs from the log")
    for key in ("patterns", "frames", "patterns_per_level", "leaves_per_level", "tensor_bytes"):
        assert whole[key] == resumed[key], key
    assert abs(whole["rig_seconds"] - resumed["rig_seconds"]) <= apart * (killed + 1) + 1e-12 * whole["rig_seconds"]
    expected, found = content(folder / "whole.h5"), content(folder / "killed.h5")
    assert expected.keys() == found.keys()
    different = [name for name in expected if expected[name] != found[name]]
    assert not different, different
    for path in folder.iterdir():
        path.unlink()


def main():
    with tempfile.TemporaryDirectory() as folder:
        for rig, algorithm, apart in CAPTURES:
            check(sys.argv[1], pathlib.Path(folder), rig, algorithm, apart)
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as beside:
        registration = f"{beside}/registration.h5"
        subprocess.run([sys.argv[1], "calibrate", "--rig", BENCH, "-o", registration], check=True, stdout=subprocess.DEVNULL)
        check(sys.argv[1], pathlib.Path(folder), BENCH, "symrig", REFRESH_SECONDS, "--registration", registration)


main()
