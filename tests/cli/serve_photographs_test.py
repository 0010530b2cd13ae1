# SPDX-License-Identifier: Apache-2.0
"""symrig serve --photographs: a simulated rig behind a socket, for captures and for clients of all kinds.

usage: serve_photographs_test.py SYMRIG CONNECT.py
Exit code 77: h5py is not installed.
"""

import contextlib
import os
import pathlib
import random
import socket
import struct
import sys
import tempfile

from scene_content import content
from served import Server, free_port, run

GREETING = b"symrig-exec 1\n"
RIG = "sim:vgroove-textured?size=16x12&noise=off"
# A fixed bracket: what a capture expects of a photograph stays on its side of the socket, and would change the exposures.
VIEWS = "sim:views2?size=24x20&exposures=4"
CELLS = 16 * 12
RECORD = 9 * CELLS


def photographs(symrig, place, rig=RIG):
    server = Server(symrig, rig, place, "--photographs")
    assert "photographs" in server.told
    return server


def memory(server):
    """Bytes that it holds."""
    for line in pathlib.Path(f"/proc/{server.process.pid}/status").read_text(encoding="ascii").splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) * 1024
    raise AssertionError("no VmRSS")


class Client:
    def __init__(self, place, greets=True):
        kind, _, rest = place.partition(":")
        if kind == "unix":
            self.link = socket.socket(socket.AF_UNIX)
            self.link.connect(rest)
        else:
            host, _, port = rest.rpartition(":")
            self.link = socket.create_connection((host, int(port)))
        self.link.settimeout(120)
        self.bytes = self.link.makefile("rb")
        if greets:
            self.link.sendall(GREETING)
            self.answer = self.bytes.readline()

    def measure(self, patterns):
        """The photographs' records, after the headers."""
        self.link.sendall(b"measure %d\n" % len(patterns) + b"".join(patterns))
        records = []
        for k in range(1, len(patterns) + 1):
            assert self.bytes.readline() == b"photograph %d %d\n" % (k, RECORD)
            records.append(self.bytes.read(RECORD))
            assert len(records[-1]) == RECORD
        return records

    def close(self):
        self.bytes.close()
        self.link.close()


def pattern(value):
    return struct.pack(f"<{CELLS}f", *[value] * CELLS)


def captures_are_the_same(symrig, connect, place, folder):
    """Polish is fixed: its default depends on the rig's time, and a socket has another clock than a simulated rig."""

    def captured(rig, name):
        run(symrig, "capture", "--rig", rig, "-o", f"{folder}/{name}.h5", "--polish", "1")
        return content(f"{folder}/{name}.h5")

    direct = captured(RIG, "direct")
    assert len(direct) > 10
    for _ in range(2):  # each client gets a new rig
        assert captured(f"exec:{sys.executable} -B {connect} {place}", "served") == direct
    assert captured(RIG.replace("vgroove-textured", "gummy"), "other") != direct


def views_are_the_same(symrig, connect, path, folder):
    """A rig of several views says so, or the search would cut its grid as one picture and show other patterns."""

    def captured(rig, name):
        run(symrig, "capture", "--rig", rig, "-o", f"{folder}/{name}.h5", "--polish", "1")
        return content(f"{folder}/{name}.h5")

    direct = captured(VIEWS, "views")
    assert direct["@camera_views"] == direct["@projector_views"] == "[2 2]", direct.keys()
    server = photographs(symrig, f"unix:{path}", VIEWS)
    try:
        for _ in range(2):
            assert captured(f"exec:{sys.executable} -B {connect} {server.place}", "served-views") == direct
        client = Client(server.place)
        assert client.answer.startswith(b"version=1 cells=24x20 camera=24x20 views=2x2 channels=1 name="), client.answer
        client.close()
        assert server.end() == 0
    finally:
        server.process.kill()


def a_second_client_is_refused(symrig, connect, place, folder):
    first = Client(place)
    assert first.answer.startswith(b"version=1 cells=16x12 camera=16x12 channels=1 name=sim:vgroove-textured"), first.answer
    second = Client(place)
    assert second.answer == b"busy: another client uses this rig\n", second.answer
    second.close()
    refused = run(symrig, "evaluate", f"{folder}/direct.h5", "--rig", f"exec:{sys.executable} -B {connect} {place}", code=3)
    assert "busy: another client uses this rig" in refused.stderr, refused.stderr
    white = first.measure([pattern(1.0), pattern(0.0), pattern(1.0)])  # it goes on
    assert white[0] == white[2] != white[1]
    first.close()


def broken_framing_is_told(place):
    for said, told in (
        (b"GET / HTTP/1.1\r\n\r\n", b"is not 'symrig-exec 1'"),
        (GREETING + b"measure 17\n", b"'measure 17' is not 'measure N'"),
        (GREETING + b"measure 0\n", b"'measure 0' is not"),
        (GREETING + b"measure -1\n", b"is not 'measure N'"),
        (GREETING + b"measure 1x\n", b"is not 'measure N'"),
        (GREETING + b"x" * 1_000_000, b"is not 'measure N'"),
        (GREETING + b"measure 1\n" + pattern(float("nan")), b"error: "),
        (GREETING + b"measure 1\n" + pattern(1.5), b"error: "),
        (GREETING + b"measure 2\n" + pattern(1.0) + pattern(-1.0), b"error: "),
    ):
        client = Client(place, greets=False)
        with contextlib.suppress(BrokenPipeError, ConnectionResetError):
            client.link.sendall(said)
        heard = client.bytes.read()
        client.close()
        assert told in heard and heard.endswith(b"\n"), (said[:60], heard[-200:])
    check_alive(place)


def clients_that_leave(place):
    for said in (b"", b"s", GREETING, GREETING + b"meas", GREETING + b"measure 16\n", GREETING + b"measure 16\n" + pattern(1.0) * 5 + b"12"):
        client = Client(place, greets=False)
        client.link.sendall(said)
        client.close()
    client = Client(place)  # asks for much and takes nothing of it
    client.link.sendall(b"measure 16\n" + pattern(1.0) * 16)
    client.close()
    check_alive(place)


def a_silent_client_loses_its_place(place):
    silent = Client(place, greets=False)
    silent.link.sendall(GREETING[:5])
    waiting = Client(place)  # is served when the time of the silent one's greeting is over
    assert waiting.answer.startswith(b"version=1 "), waiting.answer
    assert silent.bytes.read() == b""  # the server has ended it
    waiting.close()
    check_alive(place)
    silent.close()


def odd_bytes(server):
    rng = random.Random(1)
    for k in range(100):
        client = Client(server.place, greets=False)
        with contextlib.suppress(OSError):
            client.link.sendall((GREETING if k % 2 else b"") + rng.randbytes(rng.randrange(1, 20_000)))
        client.close()
    check_alive(server.place)


def check_alive(place):
    """The client before has gone, so the next one is never refused."""
    client = Client(place)
    assert client.answer.startswith(b"version=1 "), client.answer
    assert len(client.measure([pattern(1.0)])) == 1
    client.close()


def memory_is_bounded(server):
    """A flood of patterns, and of answers that nobody takes: the server holds one of each."""
    check_alive(server.place)
    before = memory(server)
    client = Client(server.place)
    client.link.settimeout(0.2)
    with contextlib.suppress(OSError):
        for _ in range(10_000):  # 123 MB if it kept them
            client.link.sendall(b"measure 16\n" + pattern(1.0) * 16)
    grown = memory(server) - before
    client.close()
    assert grown < 32 << 20, f"the server grew by {grown} bytes"
    check_alive(server.place)


def refusals(symrig, path):
    for rig, place, code, word in (
        ("sim:", f"unix:{path}", 2, "scene"),
        ("sim:nowhere", f"unix:{path}", 2, "nowhere"),
        ("exec:true", f"unix:{path}", 2, "not a simulated rig"),
        (RIG, "tcp:0.0.0.0:4000", 2, "127.0.0.1"),
        (RIG, "serial:/dev/null", 2, "no place to listen"),
    ):
        told = run(symrig, "serve", rig, "--photographs", "--listen", place, code=code).stderr
        assert told.count("\n") == 1 and word in told, told
    assert not os.path.exists(path)


def the_client_says_what_is_wrong(connect, path):
    for words, word in (((), "give one place"), ((f"unix:{path}",), path), (("tcp:nowhere",), "tcp:nowhere")):
        told = run(sys.executable, "-B", connect, *words, code=1).stderr
        assert told.count("\n") == 1 and word in told, told


def main(symrig, connect):
    with tempfile.TemporaryDirectory() as folder:
        path = f"{folder}/rig.sock"
        refusals(symrig, path)
        the_client_says_what_is_wrong(connect, path)
        views_are_the_same(symrig, connect, path, folder)
        server = photographs(symrig, f"unix:{path}")
        try:
            captures_are_the_same(symrig, connect, server.place, folder)
            a_second_client_is_refused(symrig, connect, server.place, folder)
            broken_framing_is_told(server.place)
            clients_that_leave(server.place)
            a_silent_client_loses_its_place(server.place)
            odd_bytes(server)
            memory_is_bounded(server)
            assert server.end() == 0 and not os.path.exists(path)
        finally:
            server.process.kill()
        server = photographs(symrig, f"tcp:127.0.0.1:{free_port()}")
        try:
            broken_framing_is_told(server.place)
            client = Client(server.place)
            assert server.end() == 0  # while a client is there
            client.close()
        finally:
            server.process.kill()


if __name__ == "__main__":
    main(*sys.argv[1:])
