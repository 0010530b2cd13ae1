# SPDX-License-Identifier: Apache-2.0
"""The files that the guest boots from. `prepare` makes them and prints their folders."""

import dataclasses
import pathlib
import subprocess
import sys

BENCH = pathlib.Path(__file__).resolve().parent.parent


@dataclasses.dataclass(frozen=True)
class Assets:
    """Files in the two folders that `prepare` prints."""

    debian: pathlib.Path
    ours: pathlib.Path

    @property
    def kernel(self):
        return self.debian / "vmlinux"

    @property
    def layer(self):
        return self.debian / "layer"

    @property
    def initrd(self):
        return self.ours / "initrd.cpio"

    @property
    def testcam(self):
        return self.ours / "testcam.ko"


def cannot(reason):
    """Ends the program: the bench cannot run on this computer. ctest shows status 77 as skipped."""
    print(f"bench-vm: {reason}", file=sys.stderr)
    sys.exit(77)


def prepare():
    """Makes missing files. On failure ends the program with prepare's status; 77: the bench cannot run on this computer."""
    done = subprocess.run([BENCH / "prepare"], stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode != 0:
        sys.exit(done.returncode)
    return Assets(*map(pathlib.Path, done.stdout.splitlines()))
