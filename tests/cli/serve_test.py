# SPDX-License-Identifier: Apache-2.0
"""symrig serve: a simulated board behind a local socket and a port, for the command's own hosts, one after the other.

usage: serve_test.py SYMRIG
"""

import contextlib
import json
import os
import pathlib
import random
import socket
import stat
import sys
import tempfile
import time

from served import Server, free_port, run


def board(symrig, place):
    server = Server(symrig, "sim:", place)
    assert "Ctrl-C" in server.told
    return server


def hosts_one_after_the_other(symrig, place, folder):
    here, there = (json.loads(run(symrig, "info", "--device", device, "--json", "-").stdout) for device in ("sim:", place))
    for key in ("name", "lines", "limits"):
        assert here.get(key) == there.get(key), key
    for _ in range(2):
        run(symrig, "identify", "--device", place)
    run(symrig, "conformance", place, "--filter", "hello")
    # A program with a camera that answers its triggers: the planned edges came, and none is missing.
    program = pathlib.Path(__file__).parents[2] / "examples/programs/by-hand.toml"
    assert "0 missing, 0 unplanned" in run(symrig, "run", program, "--device", place, "-o", f"{folder}/receipt.json").stdout


def a_second_host_is_told(symrig, path, place):
    with socket.socket(socket.AF_UNIX) as first:
        first.connect(path)
        time.sleep(0.2)
        for _ in range(3):
            told = run(symrig, "info", "--device", place, code=3).stderr
            assert "in use by another program" in told and told.count("\n") == 1, told
    run(symrig, "info", "--device", place)


def odd_bytes_do_no_harm(symrig, path, place):
    rng = random.Random(1)
    for _ in range(50):
        with socket.socket(socket.AF_UNIX) as link, contextlib.suppress(OSError):
            link.connect(path)
            link.sendall(rng.randbytes(rng.randrange(1, 20_000)))
    run(symrig, "info", "--device", place)


def refusals(symrig, path):
    pathlib.Path(path).write_text("mine", encoding="ascii")
    for device, place, code, word in (
        ("sim:", f"unix:{path}", 4, "remove what is there"),
        ("sim:", "tcp:0.0.0.0:4000", 2, "127.0.0.1"),
        ("sim:", "serial:/dev/null", 2, "no place to listen"),
        ("sim:", path, 2, "no place to listen"),
        ("usb:", f"unix:{path}2", 2, "no simulated board"),
        ("sim:?jumper=none:aux", f"unix:{path}2", 2, "none"),
    ):
        told = run(symrig, "serve", device, "--listen", place, code=code).stderr
        assert told.count("\n") == 1 and word in told, told
    assert pathlib.Path(path).read_text(encoding="ascii") == "mine" and not os.path.exists(path + "2")
    os.unlink(path)


def a_killed_server_leaves_no_obstacle(symrig, path):
    server = board(symrig, f"unix:{path}")
    refused = run(symrig, "serve", "sim:", "--listen", f"unix:{path}", code=4).stderr
    assert "remove what is there" in refused, refused
    run(symrig, "info", "--device", server.place)
    server.process.kill()
    server.process.wait()
    assert os.path.exists(path)
    server = board(symrig, f"unix:{path}")
    run(symrig, "info", "--device", server.place)
    assert server.end() == 0 and not os.path.exists(path)


def main(symrig):
    with tempfile.TemporaryDirectory() as folder:
        path = f"{folder}/board.sock"
        refusals(symrig, path)
        a_killed_server_leaves_no_obstacle(symrig, path)
        server = board(symrig, f"unix:{path}")
        try:
            assert stat.S_IMODE(os.stat(path).st_mode) == 0o600
            hosts_one_after_the_other(symrig, server.place, folder)
            a_second_host_is_told(symrig, path, server.place)
            odd_bytes_do_no_harm(symrig, path, server.place)
            assert server.end() == 0 and not os.path.exists(path)
        finally:
            server.process.kill()
        server = board(symrig, f"tcp:127.0.0.1:{free_port()}")
        try:
            run(symrig, "info", "--device", server.place)
            assert server.end() == 0
        finally:
            server.process.kill()


if __name__ == "__main__":
    main(*sys.argv[1:])
