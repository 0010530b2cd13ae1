# SPDX-License-Identifier: Apache-2.0
"""The servers of `symrig view` and `symrig capture --watch` under attack: refused, memory bounded, still alive, and the page still answers.

All traffic goes to 127.0.0.1. With SYMRIG_LONG: 10,000 odd requests, 1,000 connections and a body of 1 GB; without: a twentieth.

usage: attack_test.py SYMRIG
"""

import contextlib
import os
import pathlib
import random
import resource
import signal
import socket
import subprocess
import sys
import tempfile
import time

LONG = bool(os.environ.get("SYMRIG_LONG"))
ODD_REQUESTS, CONNECTIONS, BODY = (10_000, 1_000, 1 << 30) if LONG else (500, 300, 50 << 20)
# The scene takes a few MB. 64 connections with a buffer of 64 kB, a light and a reply each take less than this.
MOST_GROWTH = 64 << 20


class Server:
    def __init__(self, *command):
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        address = self.process.stdout.readline().strip()
        self.port, self.secret = int(address.split(":")[2].split("/")[0]), address.split("/")[3]
        assert address == f"http://127.0.0.1:{self.port}/{self.secret}/" and len(self.secret) == 32, address

    def connect(self):
        return socket.create_connection(("127.0.0.1", self.port), timeout=60)

    def ask(self, data):
        """The status of the reply to these bytes; 0 if the connection ended without one."""
        with self.connect() as link:
            reply = b""
            with contextlib.suppress(OSError):
                link.sendall(data)
                link.shutdown(socket.SHUT_WR)
            with contextlib.suppress(OSError):
                while len(reply) < 12 and (more := link.recv(4096)):
                    reply += more
            return int(reply[9:12]) if reply.startswith(b"HTTP/1.1 ") else 0

    def get(self, path, host="127.0.0.1", method="GET", extra=""):
        return self.ask(f"{method} {path} HTTP/1.1\r\nHost: {host}\r\n{extra}Connection: close\r\n\r\n".encode())

    def works(self):
        return self.get(f"/{self.secret}/") == 200

    def works_on(self, link):
        """Asks on a connection that stays open."""
        link.sendall(f"HEAD /{self.secret}/ HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
        reply = b""
        while not reply.endswith(b"\r\n\r\n") and (more := link.recv(4096)):
            reply += more
        return reply.startswith(b"HTTP/1.1 200 ")

    def peak(self):
        status = pathlib.Path(f"/proc/{self.process.pid}/status").read_text(encoding="ascii")
        return 1024 * int(next(line for line in status.splitlines() if line.startswith("VmHWM")).split()[1])

    def end(self):
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(timeout=60)


def refuses_strangers(server):
    page = f"/{server.secret}/"
    assert server.get(page) == 200
    for host in ("localhost", f"localhost:{server.port}", "[::1]:80", f"127.0.0.1:{server.port + 1}"):
        assert server.get(page, host) == 200, host
    for host in ("evil.example", f"evil.example:{server.port}", "127.0.0.1.evil.example", "localhost:", "", "10.0.0.1", "127.0.0.1:80a"):
        assert server.get(page, host) == 403, host
    assert server.ask(f"GET {page} HTTP/1.0\r\n\r\n".encode()) == 403  # no Host
    wrong = server.secret[:-1] + ("0" if server.secret[-1] != "0" else "1")
    for path in ("/", "/favicon.ico", f"/{wrong}/", f"/{server.secret}", "/../etc/passwd", f"//{server.secret}/", "*"):
        assert server.get(path) == 403, path
    for origin in ("http://evil.example", "null", "https://127.0.0.1.evil.example"):
        assert server.get(page, extra=f"Origin: {origin}\r\n") == 403, origin
    for path in ("../etc/passwd", "scene.h5", "held-out/99999", "held-out/-1", "held-out/0x", "%2e%2e/", "sees/99999999", "sees/-1", "sees/0x", "sees/"):
        assert server.get(page + path) == 404, path
    assert server.get(page, method="DELETE") == 405
    assert server.get(page + "relight") == 405
    for light in (b"", b"\1\0\0\0", b"\1\0\0\0\xff\xff\xff\xff", b"\2\0\0\0" * 9, b"\1\0\0\0\1\0\0\0\0\0\0\0\xff\xff\0\0"):
        head = f"POST {page}relight HTTP/1.1\r\nHost: localhost\r\nContent-Length: {len(light)}\r\n\r\n"
        assert server.ask(head.encode() + light) == 400, light
    dark = b"\1\0\0\0\0\0\0\0"
    assert server.ask(f"POST {page}relight HTTP/1.1\r\nHost: localhost\r\nContent-Length: 8\r\n\r\n".encode() + dark) == 200


def odd_request(rng, secret):
    """Random bytes, or a request with a few bytes changed, cut or repeated."""
    if rng.random() < 0.3:
        return rng.randbytes(rng.randrange(1, 400))
    path = rng.choice([f"/{secret}/", f"/{secret}/relight", f"/{secret}/sees/{rng.randrange(10**6)}", f"/{secret}/held-out/{rng.randrange(10**6)}", "/"])
    data = bytearray(f"{rng.choice(['GET', 'POST', 'HEAD', 'PUT'])} {path} HTTP/1.1\r\nHost: localhost\r\n".encode())
    if rng.random() < 0.5:
        data += f"Content-Length: {rng.choice([0, 5, -1, 2**31, 2**63, 2**64, 10**30])}\r\n".encode()
    if rng.random() < 0.3:
        data += b"Transfer-Encoding: chunked\r\n"
    if rng.random() < 0.2:
        data += b"X: " + b"a" * rng.randrange(20_000) + b"\r\n"
    data += b"\r\n" + rng.randbytes(rng.randrange(50))
    for _ in range(rng.randrange(4)):
        data[rng.randrange(len(data))] = rng.randrange(256)
    return bytes(data[: rng.randrange(1, len(data) + 1)]) if rng.random() < 0.3 else bytes(data)


def survives_odd_requests(server):
    rng = random.Random(1)
    seen = {}
    for _ in range(ODD_REQUESTS):
        status = server.ask(odd_request(rng, server.secret))
        seen[status] = seen.get(status, 0) + 1
    assert server.works()
    return seen


def survives_many_connections(server):
    """Idle ones, and some that send half a request: the page still answers, at once, and on the connection that it has."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(max(soft, CONNECTIONS + 100), hard), hard))
    links = []
    page = server.connect()
    for k in range(CONNECTIONS):
        links.append(server.connect())
        if k % 2:
            with contextlib.suppress(OSError):
                links[-1].sendall(b"GET / HT")
        if k % 100 == 0:
            assert server.works() and server.works_on(page), k
    open_files = len(os.listdir(f"/proc/{server.process.pid}/fd"))
    assert server.works() and server.works_on(page)
    for link in [page, *links]:
        link.close()
    assert open_files < 64 + 32, open_files
    return open_files


def refuses_a_large_body(server, length_header):
    """With the secret, and a body that no light has. The server closes the connection before it has read it."""
    sent, block = 0, bytes(1 << 20)
    with server.connect() as link:
        kind = f"Content-Length: {BODY}" if length_header else "Transfer-Encoding: chunked"
        link.sendall(f"POST /{server.secret}/relight HTTP/1.1\r\nHost: localhost\r\n{kind}\r\n\r\n".encode())
        with contextlib.suppress(OSError):
            while sent < BODY:
                link.sendall(block if length_header else b"100000\r\n" + block + b"\r\n")
                sent += len(block)
    assert sent < BODY, sent
    assert server.works()
    return sent


def attack(server):
    refuses_strangers(server)
    before = server.peak()
    print("replies to odd requests:", survives_odd_requests(server))
    print("open files:", survives_many_connections(server))
    print("bytes sent of a body:", refuses_a_large_body(server, True), refuses_a_large_body(server, False), "of", BODY)
    growth = server.peak() - before
    print("memory grew by", growth, "bytes")
    assert growth < MOST_GROWTH, growth


def a_scene(symrig, folder, rig, registration=()):
    scene = f"{folder}/scene.h5"
    if registration:
        subprocess.run([symrig, "calibrate", "--rig", rig, "-o", registration[1]], check=True, stdout=subprocess.DEVNULL)
    subprocess.run([symrig, "capture", "--rig", rig, *registration, "-o", scene], check=True, stdout=subprocess.DEVNULL)
    server = Server(symrig, "view", scene)
    try:
        attack(server)
        assert server.end() == 0
    finally:
        server.process.kill()


def a_capture(symrig, folder):
    """The rig waits in the middle of the search until the attack is over. Then the capture goes on to its end."""
    held = 40
    rig = f"exec:exec {sys.executable} -B {pathlib.Path(__file__).with_name('gated_rig.py')} {folder} {held}"
    server = Server(symrig, "capture", "--rig", rig, "-o", f"{folder}/live.h5", "--watch")
    try:
        while server.get(f"/{server.secret}/facts") != 200:  # the first tensor
            assert server.process.poll() is None
            time.sleep(0.01)
        attack(server)
        pathlib.Path(folder, f"gate-{held}").touch()
        rest = "".join(iter(server.process.stdout.readline, "The page now shows the scene. Ctrl-C ends.\n"))
        assert "patterns" in rest and pathlib.Path(folder, "live.h5").exists(), rest
        assert server.works()
        assert server.end() == 0
    finally:
        server.process.kill()


def main(symrig):
    with tempfile.TemporaryDirectory() as folder:
        a_scene(symrig, folder, "sim:vgroove-textured?size=16x20&noise=off")
        fine = "sim:vgroove-textured?size=16x16&fine=4&camera=76x76&turn=1.5&zoom=0.784"
        a_scene(symrig, folder, fine, ("--registration", f"{folder}/registration.h5"))
        a_capture(symrig, folder)


if __name__ == "__main__":
    main(*sys.argv[1:])
