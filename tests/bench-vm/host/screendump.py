# SPDX-License-Identifier: Apache-2.0
"""Answers the guest's requests for the picture on QEMU's display.

A request is an empty file NAME.screendump in the out folder. The answer is NAME.ppm or NAME.error, and the request is gone.
"""

import json
import socket


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
    """Looks for requests in `out`."""

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
