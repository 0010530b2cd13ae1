# SPDX-License-Identifier: Apache-2.0
"""Runs the emulated Pico outside the guest. Inside, the emulation would be about ten times too slow."""

import contextlib
import re
import select
import shutil
import subprocess
import time

from host.assets import BENCH, cannot
from host.slow_motion import environment

READY = re.compile(r"ready usbip:[\d.]+:(\d+)")
START = 600  # time-out in seconds for booting and enumerating
JUMPER = "5:17"  # aux0 to camera_strobe, the wire of the board's self-test (docs/board-pico.md)


def port_of(process):
    """Waits until the server is ready and returns its port."""
    deadline = time.monotonic() + START
    while time.monotonic() < deadline:
        if select.select([process.stdout], [], [], 0.1)[0]:
            match = READY.match(process.stdout.readline())
            if match:
                return int(match[1])
            break
    cannot(f"the emulated Pico did not start: {process.poll() is None and 'no answer' or process.stderr.read().strip()}")


@contextlib.contextmanager
def serve(image, slow):
    """Runs the emulation of this image inside the context, `slow` times slower than its clock. Gives its TCP port for USB/IP."""
    emulation = BENCH.parent / "emulation"
    node = shutil.which("node")
    if not node:
        cannot("there is no node; tools/setup test installs it")
    if not (emulation / "node_modules" / "rp2040js").exists():
        cannot("the Pico's emulator is not here; tools/setup test fetches it")
    command = [node, emulation / "usbip" / "server.mjs", "--uf2", image, "--port", "0", "--jumper", JUMPER]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment(slow)) as process:
        try:
            yield port_of(process)
        finally:
            process.kill()
