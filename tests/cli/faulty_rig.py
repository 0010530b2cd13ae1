#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A rig with one fault, as a child process: faulty_rig.py FAULT[=VALUE] [SEED] [ROWSxCOLUMNS]

FAULT is a key of FAULTS. The scene is a textured picture whose patches exchange light. The camera has shot noise and read noise.
"""
import sys

import numpy as np

FAULTS = {
    "none": "a good rig",
    "dark": "the lamp is off: no light at all, noise only",
    "capped": "a cap on the lens: the camera answers exact zeros",
    "room": "the lamp is off, and the room is lit",
    "inverted": "the projector shows black for white",
    "inverted_black": "the same, and the photograph of the pattern 'black' is subtracted",
    "late": "each photograph shows the pattern before",
    "early": "each photograph shows the pattern after, from VALUE on, in one batch",
    "doubled": "photograph VALUE comes twice, all later ones are one late",
    "once": "photograph VALUE alone shows the pattern before",
    "blended": "each photograph has VALUE of the light of the pattern before",
    "lost": "the light of photograph VALUE is lost: black",
    "frozen": "the camera answers its first photograph for ever",
    "mirrored": "left and right are exchanged in the photographs",
    "mirrored_stated": "the same, and the rig states it",
    "flipped": "top and bottom are exchanged",
    "turned": "upside down",
    "quarter": "turned by a quarter",
    "transposed": "rows and columns are exchanged: pixels come column by column",
    "slanted": "each row begins one pixel later: the length of rows is wrong",
    "moved": "the camera looks VALUE cells to the right from the start",
    "moves": "the camera moves by VALUE cells after 25 photographs",
    "ambient": "the room's light is not subtracted: VALUE of white",
    "ambient_drift": "and changes slowly",
    "black_level": "the black level is wrong by VALUE of white",
    "cut_black": "values below 0 are cut to 0",
    "clipped": "the camera clips at VALUE of white, and says that it is valid",
    "gamma": "the camera is not linear: light to the power of 1 / VALUE",
    "auto_exposure": "each photograph is scaled to the same brightness",
    "flicker": "each photograph's light differs by VALUE, relative",
    "drift": "the light changes by VALUE over 100 photographs",
    "sharpened": "unsharp masking in the camera, by VALUE",
    "stuck": "one pixel always reads VALUE of white",
    "stuck_sure": "and states almost no variance",
    "dead_row": "a row of the camera reads nothing",
    "dead_column": "a column of the camera reads nothing",
    "stuck_row": "a row of the camera always reads VALUE of white",
}
FULL_WELL, READ_NOISE = 20000, 6.0  # electrons at white

fault, _, value = sys.argv[1].partition("=")
assert fault in FAULTS, fault
seed = int(sys.argv[2]) if len(sys.argv) > 2 else 1
rows, cols = (int(side) for side in sys.argv[3].split("x")) if len(sys.argv) > 3 else (24, 24)
number = float(value) if value else None
draw = np.random.default_rng(1000 + seed)  # of the scene
noise = np.random.default_rng([seed, 7])
n = rows * cols


def scene():
    y, x = np.mgrid[0:rows, 0:cols]
    a, b, c = draw.uniform(0.25, 0.6, 2).tolist() + [draw.uniform(0, 6)]
    direct = 0.45 + 0.25 * np.sin(a * y + c) * np.cos(b * x) + 0.08 * draw.normal(size=(rows, cols)).clip(-2, 2)
    parts = []
    for _ in range(3):
        r, k = draw.uniform(0.15, 0.85, 2) * (rows, cols)
        parts.append(draw.uniform(0.03, 0.06) * np.exp(-((y - r) ** 2 + (x - k) ** 2) / draw.uniform(10, 40)))
    return direct.ravel().clip(0.05, 0.95), np.stack([p.ravel() for p in parts])


direct, parts = scene()
count, shown_before, first_answer, held = 0, np.zeros(n), None, None


def transport(pattern):
    return direct * pattern + parts.T @ (parts @ pattern)


def picture(values):
    return values.reshape(rows, cols)


def shift(values, cells):
    whole = int(np.floor(cells))
    part = cells - whole
    image = picture(values)
    at = lambda k: image[:, np.clip(np.arange(cols) + k, 0, cols - 1)]
    return ((1 - part) * at(whole) + part * at(whole + 1)).ravel()


def shown(pattern):
    """What the projector shows while the camera exposes."""
    late = fault == "late" or (fault == "doubled" and count >= number) or (fault == "once" and count == number)
    if late:
        pattern = shown_before
    if fault == "blended":
        pattern = (1 - number) * pattern + number * shown_before
    if fault in ("dark", "capped", "room") or (fault == "lost" and count == number):
        pattern = 0 * pattern
    if fault in ("inverted", "inverted_black"):
        pattern = 1 - pattern
    return pattern


def seen(light):
    """Light to electrons per white, without noise."""
    image = picture(light)
    if fault in ("mirrored", "mirrored_stated"):
        light = image[:, ::-1].ravel()
    if fault == "flipped":
        light = image[::-1].ravel()
    if fault == "turned":
        light = image[::-1, ::-1].ravel()
    if fault == "quarter":
        light = np.rot90(image).ravel()
    if fault == "transposed":
        light = image.T.ravel()
    if fault == "slanted":
        light = np.pad(image, ((0, 0), (0, 1))).ravel()[:n]
    if fault == "moved":
        light = shift(light, number)
    if fault == "moves" and count > 25:
        light = shift(light, number)
    if fault == "room":
        light = light + 0.2 * direct
    if fault in ("ambient", "ambient_drift"):
        change = 1 + 0.5 * np.sin(count / 15) if fault == "ambient_drift" else 1
        light = light + number * change * (0.5 + direct)
    if fault == "inverted_black":
        light = light - transport(np.ones(n))
    if fault == "flicker":
        light = light * (1 + number * noise.normal())
    if fault == "drift":
        light = light * (1 + number * count / 100)
    if fault == "sharpened":
        image = picture(light)
        padded = np.pad(image, 1, mode="edge")
        near = (padded[:-2, 1:-1] + padded[2:, 1:-1] + padded[1:-1, :-2] + padded[1:-1, 2:]) / 4
        light = (image + number * (image - near)).ravel()
    return light


def photograph(pattern):
    """Mean, variance and validity."""
    global count, shown_before
    count += 1
    light = seen(transport(shown(pattern)))
    shown_before = pattern
    electrons = FULL_WELL * light
    spread = np.sqrt(np.clip(electrons, 0, None) + READ_NOISE**2)
    electrons = electrons + noise.normal(size=n) * spread
    if fault == "clipped":
        electrons = np.minimum(electrons, number * FULL_WELL)
    mean, variance = electrons / FULL_WELL, (np.clip(electrons, 0, None) + READ_NOISE**2) / FULL_WELL**2
    if fault == "auto_exposure":
        gain = 0.3 / max(mean.mean(), 1e-3)
        mean, variance = gain * mean, gain**2 * variance
    if fault == "gamma":
        mean = np.clip(mean, 0, None) ** (1 / number)
    if fault == "capped":
        mean = 0 * mean
    if fault == "black_level":
        mean = mean + number
    if fault == "cut_black":
        mean = np.clip(mean, 0, None)
    if fault in ("stuck", "stuck_sure"):
        mean[n // 3] = number
        if fault == "stuck_sure":
            variance[n // 3] = 1e-9
    if fault == "dead_row":
        picture(mean)[rows // 3] = 0
    if fault == "dead_column":
        picture(mean)[:, cols // 3] = 0
    if fault == "stuck_row":
        picture(mean)[rows // 3] = number
    return [mean, variance]


def answer(pattern):
    global first_answer
    now = photograph(pattern)
    if fault == "frozen":
        first_answer = first_answer or now
        now = first_answer
    return now[0].astype("<f4").tobytes() + now[1].astype("<f4").tobytes() + np.ones(n, "u1").tobytes()


def serve(requests, answers):
    requests.readline()
    mirror = " mirror=columns" if fault == "mirrored_stated" else ""
    answers.write(f"version=1 cells={rows}x{cols} channels=1 name={sys.argv[1]}{mirror}\n".encode())
    answers.flush()
    while line := requests.readline():
        for k in range(1, int(line.split()[1]) + 1):
            record = answer(np.frombuffer(requests.read(4 * n), "<f4").astype(float))
            answers.write(b"photograph %d %d\n" % (k, len(record)) + record)
            answers.flush()


serve(sys.stdin.buffer, sys.stdout.buffer)
