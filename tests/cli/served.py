# SPDX-License-Identifier: Apache-2.0
"""What the tests of `symrig serve` share."""

import signal
import socket
import subprocess


class Server:
    """symrig serve RIG --listen PLACE [MORE...], until end(). told: what it says of itself after its address."""

    def __init__(self, symrig, rig, place, *more):
        self.place = place
        self.process = subprocess.Popen([symrig, "serve", rig, "--listen", place, *more], stdout=subprocess.PIPE, text=True)
        assert self.process.stdout.readline() == place + "\n"
        self.told = self.process.stdout.readline()

    def end(self):
        """The exit code after Ctrl-C."""
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(timeout=60)


def run(*words, code=0):
    done = subprocess.run(words, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == code, f"{words}: {done.returncode} {done.stderr}"
    return done


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]
