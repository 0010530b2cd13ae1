#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes wire/*.txt: what frames, messages, programs and configurations look like in bytes.

Written from PROTOCOL.md and symrig.proto alone; it shares no code with the library, so that the two can only
agree if both are right. Run it by hand when the protocol grows, and look at the difference:

    tests/golden/make_wire_vectors.py
"""
import pathlib
import struct

HERE = pathlib.Path(__file__).resolve().parent / "wire"


def crc32c(data):
    """Bit by bit, as the polynomial is written."""
    crc = 0xFFFFFFFF
    for byte in data:
        for bit in range(8):
            feedback = (crc ^ (byte >> bit)) & 1
            crc = (crc >> 1) ^ (0x82F63B78 if feedback else 0)
    return crc ^ 0xFFFFFFFF


def cobs(data):
    """Groups of at most 254 bytes that are not zero, each led by its length + 1."""
    groups = [[]]
    full = False
    for byte in data:
        if full:
            groups.append([])
            full = False
        if byte == 0:
            groups.append([])
            continue
        groups[-1].append(byte)
        full = len(groups[-1]) == 254
    return b"".join(bytes([len(group) + 1] + group) for group in groups)


def frame(kind, seq, ack, credit, flags, body):
    head = struct.pack("<BBHHBB", 1, kind, seq, ack, credit, flags)
    return cobs(head + body + struct.pack("<I", crc32c(head + body))) + b"\0"


REQUEST, REPLY, EVENT, DATA, ACK, NAK = range(1, 7)


def varint(value):
    out = b""
    while value >= 0x80:
        out += bytes([value & 0x7F | 0x80])
        value >>= 7
    return out + bytes([value])


def uint(field, value):
    """proto3: a zero is not written."""
    return varint(field << 3) + varint(value) if value else b""


def fixed32(field, value):
    return varint(field << 3 | 5) + struct.pack("<I", value) if value else b""


def fixed64(field, value):
    return varint(field << 3 | 1) + struct.pack("<Q", value) if value else b""


def text(field, value):
    return varint(field << 3 | 2) + varint(len(value)) + value


def message(field, body):
    """A member of a oneof is written even if it is empty."""
    return varint(field << 3 | 2) + varint(len(body)) + body


def record(op, arg, ticks):
    return struct.pack("<II", op << 28 | arg, ticks)


MESSAGES = {
    # requests
    "request.hello": message(1, uint(1, 1)),
    "request.capabilities": message(2, b""),
    "request.config_line": message(
        3, uint(1, 2) + uint(2, 1) + uint(3, 3) + uint(4, 1) + uint(6, 1) + uint(7, 250000000) + uint(8, 125000)
        + uint(9, 500)),
    "request.config_interlock": message(3, uint(1, 5) + uint(3, 6) + uint(10, 1)),
    "request.finalize_config": message(4, uint(1, 0xDEADBEEF)),
    "request.program_begin": message(6, uint(1, 7) + uint(2, 1024)),
    "request.program_commit": message(7, uint(1, 7) + uint(2, 0x01020304)),
    "request.arm": message(8, uint(1, 0x01020304) + uint(2, 0xDEADBEEF)),
    "request.arm_autonomous": message(8, uint(1, 0x01020304) + uint(2, 0xDEADBEEF) + uint(3, 1)),
    "request.start_now": message(9, varint(1 << 3) + varint(1)),
    "request.start_at": message(9, varint(2 << 3) + varint(1 << 40)),
    "request.abort": message(10, b""),
    "request.keep_alive": message(13, uint(1, 1000)),
    "request.time_ping": message(14, uint(1, 123456789012345)),
    "request.capabilities_line": message(15, uint(1, 31)),
    "request.identify": message(16, uint(1, 10)),
    "request.manual_set": message(17, uint(1, 0x0FFFFFFF) + uint(2, 5)),
    "request.program_verify": message(18, b""),
    "request.program_line": message(19, uint(1, 2)),
    "request.store_config": message(20, text(1, b"left rig")),
    "request.reboot": message(21, fixed32(1, 0x89ABCDEF) + uint(2, 1)),
    "request.starve_watchdog": message(21, fixed32(1, 0x89ABCDEF) + uint(3, 1)),
    # replies
    "reply.ok": b"",
    "reply.bad_state": uint(1, 3) + uint(3, 5),
    "reply.bad_value": uint(1, 4) + uint(2, 9),
    "reply.hello": message(
        4, uint(1, 1) + fixed32(3, 0x11223344) + text(4, b"sim") + text(5, b"0.1.0") + text(6, bytes([1, 0, 255]))
        + fixed64(7, 0x0102030405060708) + fixed32(9, 1) + uint(10, 5)),
    "reply.commit": message(7, fixed32(1, 0x01020304) + uint(2, 3200) + uint(3, 1000) + uint(4, 2000)),
    "reply.violation": uint(1, 11) + message(10, uint(1, 15) + uint(2, 5) + uint(3, 2) + uint(4, 500) + uint(5, 400)),
    "reply.status": message(
        8, uint(1, 7) + fixed32(2, 0xDEADBEEF) + fixed32(3, 0x01020304) + uint(4, 1 << 33) + fixed32(5, 0x1F)
        + message(6, uint(1, 2) + uint(2, 99) + uint(3, 2)) + uint(7, 3) + uint(8, 12)
        + uint(9, 2) + message(10, uint(1, 10)) + fixed32(11, 0xCAFEF00D)),
    "reply.capabilities": message(
        5, uint(1, 125_000_000) + uint(2, 18) + uint(3, 6) + uint(4, 0xFFFFFFFF) + uint(5, 9) + uint(6, 131_072)
        + uint(7, 4) + uint(8, 512) + uint(9, 8) + uint(10, 256) + uint(11, 1024) + uint(12, 120) + uint(13, 60_000)
        + text(14, b"left rig")),
    "reply.line": message(
        6, uint(1, 15) + text(3, b"interlock") + text(4, b"GPIO19") + uint(5, 3) + uint(6, 1) + uint(7, 2)),
    "reply.line_use": message(11, uint(1, 2) + uint(2, 12_500) + uint(3, 333)),
    # events
    "event.step_mark": message(1, uint(1, 4) + uint(2, 17) + uint(3, 5_000_000_000)),
    "event.edge": message(2, uint(1, 4) + uint(2, 1) + uint(3, 77)),
    "event.run_done": message(
        4, uint(1, 2) + uint(2, 300) + uint(3, 200) + uint(4, 9) + uint(6, 1) + uint(7, 3) + uint(8, 2)),
    "event.events_lost": message(6, uint(1, 12) + uint(2, 345)),
}

FRAMES = {
    "ack": (ACK, 0, 0, 0, 0, b""),
    "hello": (REQUEST, 0x1234, 0, 64, 1, MESSAGES["request.hello"]),
    "abort": (REQUEST, 0x8001, 0xFFFF, 0, 2, MESSAGES["request.abort"]),
    "reply_ok": (REPLY, 3, 8, 8, 0, b""),
    "mark": (EVENT, 0xFFFF, 8, 8, 0, MESSAGES["event.step_mark"]),
    "nak": (NAK, 1, 2, 8, 0, b""),
    "no_zero_254": (DATA, 0x0101, 0x0101, 1, 1, bytes([1 + i % 255 for i in range(242)])),
    "zeros": (DATA, 0, 0, 0, 0, bytes(300)),
    "largest": (DATA, 0x0101, 0x0101, 8, 4, bytes([(i * 7 + 1) % 256 for i in range(500)])),
}

PROGRAMS = {
    # camera line 1 high for 12500 ticks, three times, with a mark and a wait before; ends with all lines low
    "bracket": [(5, 0, 0), (1, 1, 12500), (1, 0, 5), (4, 3 | 0 << 5 | 1 << 7, 6250000), (2, 0, 3), (5, 1, 0),
                (1, 2, 12500), (1, 0, 500000), (3, 0, 0), (6, 0, 0)],
    "extremes": [(1, 0x0FFFFFFF, 0xFFFFFFFF), (2, 1, 0), (1, 0, 1), (3, 0, 0), (6, 0x0FFFFFFF, 0)],
}

# line, output, role, hazard, safe level, capture, duty, max on, min off
CONFIGS = {
    "default_board": [(0, 1, 1, 0, 0, 0, 0, 0, 0), (1, 1, 2, 0, 0, 0, 0, 0, 0), (2, 1, 3, 0, 0, 0, 0, 0, 0),
                      (3, 0, 4, 0, 0, 0, 0, 0, 0), (4, 0, 5, 0, 0, 0, 0, 0, 0)],
    "interlock": [(5, 0, 6, 0, 0, 2, 0, 0, 0)],
    "lamp": [(2, 1, 3, 1, 1, 1, 250, 125_000_000, 1 << 40)],
}


def write(name, lines):
    (HERE / name).write_text("\n".join(["# made by make_wire_vectors.py"] + lines) + "\n")


HERE.mkdir(exist_ok=True)
assert crc32c(b"123456789") == 0xE3069283
write("messages.txt", [f"{name} {body.hex() or '-'}" for name, body in MESSAGES.items()])
write("frames.txt", [
    f"{name} {kind} {seq} {ack} {credit} {flags} {body.hex() or '-'} {frame(kind, seq, ack, credit, flags, body).hex()}"
    for name, (kind, seq, ack, credit, flags, body) in FRAMES.items()])
write("cobs.txt", [f"{data.hex() or '-'} {cobs(data).hex()}" for data in [
    b"", b"\0", b"\0\0", b"\x11\x22\0\x33", b"\x11\x22\x33\x44", b"\x11\0\0\0",
    bytes(range(1, 255)), b"\0" + bytes(range(1, 255)), bytes(range(1, 256)), bytes(range(2, 256)) + b"\0",
    bytes(range(3, 256)) + b"\0\1"]])
write("programs.txt", [
    f"{name} {b''.join(record(*r) for r in records).hex()} {crc32c(b''.join(record(*r) for r in records)):08x}"
    for name, records in PROGRAMS.items()])
write("configs.txt", [
    f"{name} {crc32c(b''.join(struct.pack('<BBBBBBHQQ', *line) for line in lines)):08x}"
    for name, lines in CONFIGS.items()])
write("chunks.txt", [
    f"{pid} {offset} {data.hex()} {(struct.pack('<IIHH', pid, offset, len(data), 0) + data).hex()}"
    for pid, offset, data in [(1, 0, bytes(8)), (0xFFFFFFFF, 488, bytes(range(16)))]])
