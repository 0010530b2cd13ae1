# SPDX-License-Identifier: Apache-2.0
"""A rig of exec: that behaves, or breaks one rule.

usage: exec_child.py ANSWER FAULT [ARGUMENT]

ANSWER  its answer to the greeting
FAULT   "none", or the rule that it breaks, as named in this file; ARGUMENT says how much

A photograph shows each pixel p of its pattern as 2 p, and states no noise. A camera pixel shows the cell at its raster index.
"""

import os
import re
import signal
import struct
import sys
import time

ANSWER, FAULT = sys.argv[1:3]
ARGUMENT = sys.argv[3] if len(sys.argv) > 3 else ""


def size(key):
    rows, cols = re.search(key + r"=(\d+)x(\d+)", ANSWER).groups()
    return int(rows) * int(cols)


CELLS = size("cells")
PIXELS = size("camera") if "camera=" in ANSWER else CELLS
CHANNELS = int(re.search(r"channels=(\d+)", ANSWER)[1])
VALUES = PIXELS * CHANNELS


def write(data):
    while data:
        data = data[os.write(1, data) :]


def read(count):
    data = b""
    while len(data) < count:
        piece = os.read(0, count - len(data))
        if not piece:
            sys.exit(9)
        data += piece
    return data


def read_line():
    line = b""
    while not line.endswith(b"\n"):
        byte = os.read(0, 1)
        if not byte:
            sys.exit(0)
        line += byte
    return line


def planes(pattern):
    cells = list(struct.unpack(f"<{CELLS}f", pattern))
    mean = [2 * cells[i % PIXELS % CELLS] for i in range(VALUES)]
    variance, valid = [0.0] * VALUES, [1] * VALUES
    if FAULT == "mean":
        mean[-1] = float(ARGUMENT)
    if FAULT == "variance":
        variance[-1] = float(ARGUMENT)
    if FAULT == "valid":
        valid[-1] = int(ARGUMENT)
    if FAULT == "invalid":
        mean[0], variance[0], valid[0] = float("nan"), -1.0, 0
    return struct.pack(f"<{VALUES}f{VALUES}f{VALUES}B", *mean, *variance, *valid)


def answer(number, pattern):
    record = planes(pattern)
    if FAULT == "size":
        record += b"x" * int(ARGUMENT)
    if FAULT == "number":
        number += int(ARGUMENT)
    data = b"photograph %d %d\n" % (number, len(record)) + record
    if FAULT == "truncated":
        data = data[: int(ARGUMENT)]
    if FAULT == "chatter":
        data += b"done!\n"
    write(data)
    if FAULT == "truncated":
        sys.exit(4)


def batch(count):
    if FAULT == "killed":
        os.kill(os.getpid(), signal.SIGKILL)
    if FAULT == "exit":
        sys.exit(int(ARGUMENT))
    if FAULT == "closed":
        os.close(1)
        time.sleep(600)
    if FAULT == "hangs":
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        time.sleep(600)
    if FAULT == "random":
        write(os.urandom(int(ARGUMENT)))
        sys.exit(0)
    if FAULT == "early":  # answers all before it reads
        for number in range(1, count + 1):
            answer(number, bytes(4 * CELLS))
        read(count * 4 * CELLS)
        return
    if FAULT == "deaf":
        os.close(0)
        for number in range(1, count + 1):
            answer(number, bytes(4 * CELLS))
        time.sleep(600)
    if FAULT == "whole":  # reads all before it answers
        patterns = [read(4 * CELLS) for _ in range(count)]
        for number, pattern in enumerate(patterns, 1):
            answer(number, pattern)
        return
    for number in range(1, count + 1):
        pattern = read(4 * CELLS)
        if FAULT == "slow":
            time.sleep(float(ARGUMENT))
        answer(number, pattern)


def main():
    if read_line() != b"symrig-exec 1\n":
        sys.exit(8)
    if FAULT == "leaves":  # a process of its own group, and the file to write both numbers to
        other = os.fork()
        if other == 0:
            os.close(0)
            os.close(1)
            time.sleep(600)
            os._exit(0)
        with open(ARGUMENT, "w", encoding="utf-8") as file:
            file.write(f"{os.getpid()} {other}")
    write(ANSWER.encode() + b"\n")
    while True:
        batch(int(read_line().split()[1]))


main()
