# SPDX-License-Identifier: Apache-2.0
"""The committed kernel of the page is what its source compiles to. Exits with 77 (skipped) without clang 14 and lld 14.

usage: kernel_build_test.py
"""

import pathlib
import shutil
import subprocess
import sys
import tempfile

KERNEL = pathlib.Path(__file__).resolve().parents[2] / "host" / "viewer" / "kernel"


def main():
    if not shutil.which("clang-14") or not pathlib.Path("/usr/bin/wasm-ld-14").exists():
        print("skipped: needs clang-14 and lld-14")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        built = pathlib.Path(folder) / "kernel.wasm"
        subprocess.run([KERNEL / "build", built], check=True)
        if built.read_bytes() != (KERNEL / "relight_kernel.wasm").read_bytes():
            print("relight_kernel.wasm is not what relight_kernel.cpp compiles to; run host/viewer/kernel/build")
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
