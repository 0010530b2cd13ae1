# SPDX-License-Identifier: Apache-2.0
"""What runs outside the guest for it: slow motion, the picture of its display, the emulated Pico."""

import contextlib
import glob
import json
import os
import re
import select
import shutil
import socket
import subprocess
import time

from host.assets import BENCH, cannot

# Slow motion: the clocks of QEMU and its helper processes run K times slower. So a second of the guest has K seconds of computing time.
# libfaketime (https://github.com/wolfcw/libfaketime) does it, for every process that has its environment; their rates are the same.

# The processor's own counter is not slowed. A guest that measures its rate against a slowed clock is wrong by about 100 ppm.
SLOW_KERNEL_ARGUMENTS = ("clocksource=hpet", "tsc=unstable")


def slow_environment(slow):
    """The environment of a process in slow motion. Unchanged for 1."""
    if slow == 1:
        return None
    library = glob.glob("/usr/lib/*-linux-gnu/faketime/libfaketimeMT.so.1")
    if not library:
        cannot("slow motion needs libfaketime; tools/setup test installs it")
    return os.environ | {"LD_PRELOAD": library[0], "FAKETIME": f"+0 x{1 / slow:.9f}", "NO_FAKE_STAT": "1"}


class Monitor:
    """QEMU's monitor, by its protocol QMP (https://www.qemu.org/docs/master/interop/qmp-spec.html)."""

    def __init__(self, path):
        self._socket = socket.socket(socket.AF_UNIX)
        self._socket.connect(str(path))
        self._lines = self._socket.makefile("rw", encoding="utf-8")
        self._lines.readline()  # the greeting
        self.ask("qmp_capabilities")

    def ask(self, command, **arguments):
        """Returns None, or QEMU's error."""
        self._lines.write(json.dumps({"execute": command, "arguments": arguments}) + "\n")
        self._lines.flush()
        for line in self._lines:
            answer = json.loads(line)
            if "event" not in answer:
                return answer.get("error", {}).get("desc")
        return "QEMU has closed its monitor"


class Screendumps:
    """Answers the guest's requests for the picture on QEMU's display.

    A request is an empty file NAME.screendump in the out folder. The answer is NAME.ppm or NAME.error, and the request is gone.
    """

    def __init__(self, out, monitor, vga):
        self._out, self._path, self._vga, self._monitor = out, monitor, vga, None

    def answer(self):
        """Answers the present requests. Quick if there are none."""
        for request in self._out.glob("*.screendump"):
            self._answer(request)

    def _answer(self, request):
        picture = request.with_suffix(".ppm")
        if self._vga:
            self._monitor = self._monitor or Monitor(self._path)
            whole = picture.with_suffix(".ppm.new")
            error = self._monitor.ask("screendump", filename=str(whole.resolve()), device="vga", head=0)
        else:
            error = "this guest has no vga display; add vga=WxH to --with"
        if error:
            request.with_suffix(".error").write_text(error + "\n")
        else:
            whole.replace(picture)
        request.unlink()


# The emulated Pico: inside the guest, the emulation would be about ten times too slow.
PICO_READY = re.compile(r"ready usbip:[\d.]+:(\d+)")
PICO_START = 600  # time-out in seconds for booting and enumerating
JUMPER = "5:17"  # aux0 to camera_strobe, the wire of the board's self-test (docs/board-pico.md)


def port_of(process):
    """Waits until the server is ready and returns its port."""
    deadline = time.monotonic() + PICO_START
    while time.monotonic() < deadline:
        if select.select([process.stdout], [], [], 0.1)[0]:
            match = PICO_READY.match(process.stdout.readline())
            if match:
                return int(match[1])
            break
    cannot(f"the emulated Pico did not start: {process.poll() is None and 'no answer' or process.stderr.read().strip()}")


@contextlib.contextmanager
def serve_pico(image, slow):
    """Runs the emulation of this image inside the context, `slow` times slower than its clock. Gives its TCP port for USB/IP."""
    emulation = BENCH.parent / "emulation"
    node = shutil.which("node")
    if not node:
        cannot("there is no node; tools/setup test installs it")
    if not (emulation / "node_modules" / "rp2040js").exists():
        cannot("the Pico's emulator is not here; tools/setup test fetches it")
    command = [node, emulation / "usbip" / "server.mjs", "--uf2", image, "--port", "0", "--jumper", JUMPER]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=slow_environment(slow)) as process:
        try:
            yield port_of(process)
        finally:
            process.kill()
