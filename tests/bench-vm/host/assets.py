# SPDX-License-Identifier: Apache-2.0
"""What the guest boots from: made by `prepare`, found through it."""

import dataclasses
import pathlib
import subprocess
import sys

BENCH = pathlib.Path(__file__).resolve().parent.parent


@dataclasses.dataclass(frozen=True)
class Assets:
    """Files of the two folders that `prepare` names."""

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
    """Ends the program: this machine cannot have the bench. ctest shows 77 as skipped."""
    print(f"bench-vm: {reason}", file=sys.stderr)
    sys.exit(77)


def prepare():
    """Makes what is missing. Ends the program with prepare's status, 77 if this machine cannot have the bench."""
    done = subprocess.run([BENCH / "prepare"], stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode != 0:
        sys.exit(done.returncode)
    return Assets(*map(pathlib.Path, done.stdout.splitlines()))
