#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Joins standard input and output to a socket: symrig capture --rig 'exec:python3 examples/exec/connect.py unix:/tmp/rig.sock' -o scene.h5

`symrig serve sim:NAME --photographs` is at the other end.
usage: connect.py unix:PATH|tcp:127.0.0.1:PORT
"""

import os
import shutil
import socket
import sys
import threading


def connect(place):
    kind, _, rest = place.partition(":")
    if kind == "unix":
        link = socket.socket(socket.AF_UNIX)
        link.connect(rest)
        return link
    host, _, port = rest.rpartition(":")
    return socket.create_connection((host.strip("[]"), int(port)))


def send(link):
    with link.makefile("wb", buffering=0) as wire, open(0, "rb", buffering=0) as patterns:
        shutil.copyfileobj(patterns, wire)
    link.shutdown(socket.SHUT_WR)  # symrig has closed its end


def main():
    if len(sys.argv) != 2:
        sys.exit("connect.py: give one place, unix:PATH or tcp:127.0.0.1:PORT")
    try:
        link = connect(sys.argv[1])
    except (OSError, ValueError) as error:
        sys.exit(f"connect.py: nothing answers at {sys.argv[1]} ({error}); start symrig serve there first")
    threading.Thread(target=send, args=[link], daemon=True).start()
    while data := link.recv(65536):
        while data:
            data = data[os.write(1, data) :]


main()
