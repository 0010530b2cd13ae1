#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""T on the camera's own pixels, and of an ideal coaxial rig, in a scene rendered by Mitsuba 3.

  rendered_bench.py render FOLDER             writes FOLDER/bench.npy and ideal.npy: T of both rigs
  rendered_bench.py rig FOLDER bench|ideal    answers symrig's patterns (exec:, docs/howto-own-rig.md)
  rendered_bench.py judge FOLDER              compares FOLDER/bench.h5 and ideal.h5 with T, of these commands:

  R='exec:python3 rendered_bench.py rig FOLDER'
  symrig calibrate --rig "$R bench" -o registration.h5
  symrig capture --rig "$R bench" --registration registration.h5 -o bench.h5 --json bench.json
  symrig capture --rig "$R ideal" -o ideal.h5 --json ideal.json

render needs `pip install mitsuba` and libLLVM of 17 or later (DRJIT_LIBLLVM_PATH).
"""
import json
import sys
import time
from pathlib import Path

import numpy as np

CELLS = 32  # of the projector, along a side
PIXELS, TURN, ZOOM, SHIFT = 152, 1.5, 0.784, (3.3, -2.1)  # the bench's camera; degrees; (x, y) in pixels
HALF = 0.364  # of the projector's picture, at distance 1
PASSES = {"ideal": 576, "bench": 160}  # points of each pixel, for indirect light
SURFACES = 3  # on the way of indirect light, without the one that the projector lights
NEAR = 0.06  # light between closer points is taken as at this distance; a cell is some 0.07 wide
PHOTON, READ = 1e-5, 1e-8  # variance of a photograph: PHOTON * light + READ; a bright pixel has light 0.8


def cells_of(grid, row, col):
    """Where a point of the photograph lies on the projector's cells: row and column."""
    if grid == CELLS:
        return row, col
    scale, angle = CELLS / (PIXELS * ZOOM), np.radians(TURN)
    y, x = (row - PIXELS / 2 - SHIFT[1]) * scale, (col - PIXELS / 2 - SHIFT[0]) * scale
    sin, cos = np.sin(angle), np.cos(angle)
    return y * cos - x * sin + CELLS / 2, x * cos + y * sin + CELLS / 2


def scene_of(mi, T):
    """A corner of a room with two balls, a fin and a post, before a projector and camera in the origin."""
    random = np.random.default_rng(3)

    def texture(low, high, size, stripes=0):
        picture = np.kron(random.uniform(low, high, (size, size)), np.ones((8, 8)))
        picture *= 1 - stripes * (np.arange(size * 8) // 6 % 2)[:, None]
        picture = {"type": "bitmap", "bitmap": mi.Bitmap(picture[..., None].astype(np.float32)), "raw": True}
        return {"type": "diffuse", "reflectance": picture}

    def shape(kind, at, axis, turn, size, bsdf):
        return {"type": kind, "to_world": T().translate(at).rotate(axis, turn).scale(size), "bsdf": bsdf}

    up, along, wall, block = [0, 1, 0], [0, 0, 1], "rectangle", "cube"
    grey, dim = ({"type": "diffuse", "reflectance": value} for value in (0.6, 0.15))
    metal = {"type": "roughconductor", "alpha": 0.35, "eta": 1.4, "k": 7.0, "distribution": "ggx"}
    glass = {"type": "roughdielectric", "alpha": 0.6, "int_ior": 1.4, "distribution": "ggx"}
    return mi.load_dict({
        "type": "scene",
        "left": shape(wall, [-1.3, 0.4, -3.2], up, 45, [2.2, 1.6, 1], texture(0.25, 0.75, 12)),
        "right": shape(wall, [1.7, 0.4, -3.2], up, -45, [2.2, 1.6, 1], texture(0.5, 0.7, 6, 0.5)),
        "floor": shape(wall, [0, -0.85, -3], [1, 0, 0], -90, [3, 2.5, 1], texture(0.3, 0.6, 20)),
        "metal": {"type": "sphere", "center": [-0.6, -0.4, -3.0], "radius": 0.4, "bsdf": metal},
        "glass": {"type": "sphere", "center": [0.62, -0.5, -2.9], "radius": 0.34, "bsdf": glass},
        "fin": shape(block, [0.12, 0.1, -3.0], along, 20, [0.035, 0.4, 0.15], grey),
        "post": shape(block, [-0.15, -0.7, -2.5], up, 30, [0.12, 0.15, 0.12], dim),
    })


class Renderer:
    """All pixels have the same points and random numbers in a pass: errors are smooth over the picture."""

    def __init__(self, grid):
        import drjit as dr
        import mitsuba as mi
        mi.set_variant("llvm_ad_mono")
        dr.set_thread_count(1)
        self.dr, self.mi, self.grid = dr, mi, grid
        self.scene = scene_of(mi, mi.ScalarTransform4f)

    def look(self, row, col):
        """What lies at these points of the projector's picture."""
        to = np.stack([HALF * (2 * col / CELLS - 1), HALF * (1 - 2 * row / CELLS), np.full(len(row), -1)])
        to = self.mi.Vector3f((to / np.linalg.norm(to, axis=0)).astype(np.float32))
        return self.scene.ray_intersect(self.mi.Ray3f(self.mi.Point3f(0), to))

    def direct(self, side=16):
        """Light that comes straight back. The projector shines 1/cos^3 in each direction: a flat picture."""
        dr, mi, numbers = self.dr, self.mi, np.arange(self.grid**2)
        T = np.zeros((self.grid**2, CELLS**2))
        for k in range(side**2):
            at = np.array([k // side, k % side]) / side + 0.5 / side
            row, col = cells_of(self.grid, numbers // self.grid + at[0], numbers % self.grid + at[1])
            x = self.look(row, col)
            cos = dr.abs(dr.normalize(mi.Vector3f(x.p)).z)
            light = x.bsdf().eval(mi.BSDFContext(), x, x.wi).x / (dr.squared_norm(x.p) * cos**3)
            light = dr.select(x.is_valid(), light, 0).numpy()
            on = (row >= 0) & (col >= 0) & (row < CELLS) & (col < CELLS)
            T[numbers[on], (row.astype(int) * CELLS + col.astype(int))[on]] += light[on] / side**2
        return T

    def indirect(self, passes, chunk=2048):
        """Light by two to four surfaces: a path from each pixel, joined to a point of each cell."""
        dr, mi = self.dr, self.mi
        numbers, cells = np.arange(self.grid**2), np.arange(CELLS**2)
        T = np.zeros((self.grid**2, CELLS**2), np.float32)
        backwards = mi.BSDFContext(mi.TransportMode.Importance)
        steps = 1.0670**-np.arange(1.0, 11)  # a sequence that fills ten dimensions evenly
        for k in range(passes):
            u = (0.5 + (k + 1) * steps) % 1
            y_of_cells = self.look(cells // CELLS + u[0], cells % CELLS + u[1])
            for first in range(0, len(numbers), chunk):
                some = numbers[first:first + chunk]
                at = cells_of(self.grid, some // self.grid + u[2], some % self.grid + u[3])
                x_of_pixels, share = self.look(*at), dr.ones(mi.Float, len(some))
                dr.eval(x_of_pixels, y_of_cells)
                lane = dr.arange(mi.UInt32, len(some) * CELLS**2)
                y, total = dr.gather(mi.SurfaceInteraction3f, y_of_cells, lane % CELLS**2), mi.Float(0)
                for surface in range(SURFACES):
                    x = dr.gather(mi.SurfaceInteraction3f, x_of_pixels, lane // CELLS**2)
                    square = dr.maximum(dr.squared_norm(y.p - x.p), NEAR**2)
                    to = dr.normalize(y.p - x.p)
                    light = x.bsdf().eval(mi.BSDFContext(), x, x.to_local(to)).x / square
                    light *= y.bsdf().eval(backwards, y, y.to_local(-to)).x
                    light *= dr.gather(mi.Float, share, lane // CELLS**2) * (2 * HALF / CELLS)**2
                    seen = x.is_valid() & y.is_valid() & (light > 0)
                    seen &= ~self.scene.ray_test(x.spawn_ray_to(y.p), seen)
                    total += dr.select(seen, light, 0)
                    if surface + 1 == SURFACES:
                        break
                    x, (a, b, c) = x_of_pixels, map(float, u[4 + 3 * surface:7 + 3 * surface])
                    a, b = dr.opaque(mi.Float, a), mi.Point2f(dr.opaque(mi.Float, b), dr.opaque(mi.Float, c))
                    way, weight = x.bsdf().sample(mi.BSDFContext(), x, a, b)
                    share = dr.select(x.is_valid(), share * weight.x, 0)
                    x_of_pixels = self.scene.ray_intersect(x.spawn_ray(x.to_world(way.wo)), share > 0)
                    dr.eval(x_of_pixels, share)
                T[first:first + chunk] += total.numpy().reshape(len(some), -1) / passes
        return T


def render(folder):
    facts = {}
    for name, grid in (("ideal", CELLS), ("bench", PIXELS)):
        start, renderer = time.time(), Renderer(grid)
        direct, indirect = renderer.direct(), renderer.indirect(PASSES[name])
        T = direct + indirect
        if name == "ideal":  # T is symmetric: a cell weighs light as it weighs photographs
            np.fill_diagonal(indirect, 0)
            facts["asymmetry"] = float(np.linalg.norm(indirect - indirect.T) / 2 / np.linalg.norm(indirect))
            T = (T + T.T) / 2
            scale = 0.8 / np.percentile(T.sum(1), 98)
        np.save(folder / (name + ".npy"), (T * scale).astype(np.float32))
        facts[name] = {"seconds": time.time() - start, "indirect": float(1 - direct.sum() / T.sum())}
    print(json.dumps(facts, indent=1))


def rig(folder, which):
    T = np.load(folder / ("ideal.npy" if which == "ideal" else "bench.npy"))
    patterns, answers, random = sys.stdin.buffer, sys.stdout.buffer, np.random.default_rng()
    patterns.readline()  # symrig-exec 1
    camera = f" camera={PIXELS}x{PIXELS}" if which != "ideal" else ""
    answers.write(f"version=1 cells={CELLS}x{CELLS} channels=1{camera} name=rendered-{which}\n".encode())
    answers.flush()
    while line := patterns.readline():
        for number in range(1, int(line.split()[1]) + 1):
            light = T @ np.frombuffer(patterns.read(4 * CELLS**2), "<f4")
            variance = PHOTON * light + READ
            mean = light + random.normal(size=len(light)) * np.sqrt(variance)
            record = np.stack([mean, variance]).astype("<f4").tobytes() + bytes([1]) * len(light)
            answers.write(b"photograph %d %d\n" % (number, len(record)) + record)
            answers.flush()


def boxes(grid):
    """The cells that each pixel sees, with a margin: top, left, bottom, right. And if it sees only cells."""
    at, margin = np.arange(grid + 1.0), 0.1 if grid != CELLS else -0.1
    ends = [np.stack([p[:-1, :-1], p[1:, :-1], p[:-1, 1:], p[1:, 1:]]).reshape(4, -1)
            for p in cells_of(grid, at[:, None] + 0 * at, at + 0 * at[:, None])]
    box = np.stack([p.min(0) for p in ends] + [p.max(0) for p in ends])
    inside = (box[:2].min(0) >= 0) & (box[2:].max(0) <= CELLS)
    box[:2], box[2:] = box[:2] - margin, box[2:] + margin
    return np.clip(np.floor(box), 0, CELLS - 1).astype(int), inside


def dark(light, box):
    sums = np.pad((light.reshape(CELLS, CELLS) != 0).cumsum(0).cumsum(1), ((1, 0), (1, 0)))
    top, left, bottom, right = box
    return sums[bottom + 1, right + 1] - sums[top, right + 1] - sums[bottom + 1, left] + sums[top, left] == 0


def smooth_picture(random):
    picture = np.zeros((CELLS, CELLS))
    for steps in (3, 7, 17, 41):
        heights, at = random.uniform(size=(steps + 2, steps + 2)), np.arange(CELLS) * steps / CELLS
        whole, part = at.astype(int), 0.5 - 0.5 * np.cos(np.pi * (at % 1))
        rows = heights[whole] * (1 - part[:, None]) + heights[whole + 1] * part[:, None]
        picture += (rows[:, whole] * (1 - part) + rows[:, whole + 1] * part) / steps
    return (picture - picture.min()) / np.ptp(picture)


def errors(T, found, grid):
    """Relative rms errors: those of `symrig evaluate`, and of dots."""
    random, (box, counted), count = np.random.default_rng(7), boxes(grid), CELLS**2
    bar = np.isin(np.arange(count) % CELLS, range(CELLS * 5 // 16, CELLS * 7 // 16))
    signs = random.choice([-1.0, 1.0], (24, count))
    lights = {  # patterns, and whether only dark pixels count
        "dots": (random.uniform(size=(16, count)) < 1 / 64, True),
        "bar_indirect": ([bar], True),
        "relight random": (random.uniform(size=(4, count)) < 0.5, False),
        "relight natural": ([smooth_picture(random).ravel() for _ in range(4)], False),
        "relight bar": ([bar], False),
        "flood": (np.ones((1, count)), False),
        "frobenius": (signs[:12], False),
        "indirect": (signs[12:] * (random.uniform(size=(12, count)) < 1 / 16), True),
    }
    out = {}
    for name, (patterns, aside) in lights.items():
        sums = np.zeros(2)
        for light in np.asarray(patterns, np.float32):
            seen, truth = counted & dark(light, box) if aside else counted, T @ light
            sums += np.sum((found @ light - truth)[seen]**2), np.sum(truth[seen]**2)
        out[name] = float(np.sqrt(sums[0] / sums[1]))
    return out


def judge(folder):
    import symrig  # PYTHONPATH=build/release/host/python
    true, stated = {}, {}
    for name, grid in (("bench", PIXELS), ("ideal", CELLS)):
        scene = symrig.load(folder / (name + ".h5"))
        found = scene.camera or scene
        true[name], stated[name] = errors(np.load(folder / (name + ".npy")), found, grid), found.errors()
    for key, value in true["bench"].items():
        line = f"{key:16} {value:.5f}, ideal {true['ideal'][key]:.5f}, ratio {value / true['ideal'][key]:.2f}"
        for name in true:
            if (told := stated[name].get(key)) is not None:
                holds = "holds" if abs(told.value - true[name][key]) <= told.half_width else "MISSED"
                line += f"; {name} estimates {told.value:.5f} +- {told.half_width:.5f}: {holds}"
        print(line)


command, *words = sys.argv[1:] or [""]
if {"render": 1, "rig": 2, "judge": 1}.get(command) != len(words):
    sys.exit(__doc__)
{"render": render, "rig": rig, "judge": judge}[command](Path(words[0]), *words[1:])
