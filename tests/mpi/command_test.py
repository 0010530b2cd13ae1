#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: Apache-2.0
"""The command `symrig-mpi` as a person meets it: its files, its messages, its exit codes.

usage: command_test.py MPIRUN SYMRIG SYMRIG-MPI HOWTO
HOWTO  docs/howto-machines.md, which names every command, and every option of `solve` and `polish`
"""

import fcntl
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time

import h5py
import numpy as np

MPIRUN, SYMRIG, MPI, HOWTO = sys.argv[1:5]
# When a rank dies, mpirun stops the others, and kills them a second later: on a busy computer before they have said a word.
MPIRUN_PATIENT = [MPIRUN, "--mca", "odls_base_sigkill_timeout", "30"]
RIG = "sim:vgroove-textured?size=32x32&noise=off"
NOISY = "sim:vgroove-textured?size=64x64"
# Of float sums: all pixels of a leaf, all leaves on a pixel's path, four ranks (DealtTransport). The factors of this scene are
# not negative but for rounding, so the sums of magnitudes are the photograph itself. Both sides round.
ROUNDING = 2 * (32 * 32 + 200 + 4 + 4) * 2.0**-24


def run(*words, folder, code=0):
    done = subprocess.run([str(w) for w in words], cwd=folder, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == code, f"{words}: {done.returncode}\n{done.stdout}\n{done.stderr}"
    return done


def ranks(count, *words, folder, code=0):
    return run(MPIRUN, "-n", count, MPI, *words, folder=folder, code=code)


def ours(text):
    """The lines that are not mpirun's."""
    return [line for line in text.splitlines() if line.startswith("symrig-mpi")]


def read_pfm(path):
    head, size, scale, values = path.read_bytes().split(b"\n", 3)
    cols, rows = map(int, size.split())
    assert head in (b"Pf", b"PF") and float(scale) < 0
    return np.frombuffer(values, "<f4").reshape(rows, cols, -1)


def test_one_rank_is_symrig(folder):
    run(SYMRIG, "relight", "scene.h5", "--light", "letters", "-o", "whole.pfm", folder=folder)
    run(MPI, "relight", "scene.h5", "--light", "letters", "-o", "alone.pfm", folder=folder)
    assert (folder / "whole.pfm").read_bytes() == (folder / "alone.pfm").read_bytes()


def test_any_number_of_ranks_relights_alike(folder):
    whole = read_pfm(folder / "whole.pfm")
    for count in (1, 2, 3, 4):
        out = f"relit-{count}.pfm"
        told = ranks(count, "relight", "scene.h5", "--light", "letters", "-o", out, folder=folder)
        assert told.stdout.startswith(f"{out}: 32x32, 1 channel, radiance")
        dealt = read_pfm(folder / out)
        assert np.abs(dealt - whole).max() <= ROUNDING * whole.max()


def test_many_lights(folder):
    lights = folder / "lights"
    lights.mkdir()
    for k in range(20):
        picture = np.full((32, 32), k / 20, "<f4")
        (lights / f"{k:02}.pfm").write_bytes(b"Pf\n32 32\n-1.0\n" + picture.tobytes())
    run(SYMRIG, "relight", "scene.h5", "--lights", "lights", "--format", "pfm", "-o", "one", folder=folder)
    ranks(3, "relight", "scene.h5", "--lights", "lights", "--format", "pfm", "-o", "three", folder=folder)
    for k in range(20):
        whole, dealt = read_pfm(folder / f"one/{k:02}.pfm"), read_pfm(folder / f"three/{k:02}.pfm")
        assert np.abs(dealt - whole).max() <= ROUNDING * max(whole.max(), 1e-6)


def test_evaluate(folder):
    run(SYMRIG, "evaluate", "scene.h5", "--rig", RIG, "--json", "one.json", folder=folder)
    whole = json.loads((folder / "one.json").read_text())["error"]
    for count in (2, 4):
        ranks(count, "evaluate", "scene.h5", "--rig", RIG, "--json", "dealt.json", folder=folder)
        dealt = json.loads((folder / "dealt.json").read_text())["error"]
        flat = lambda e: np.array([v for x in e.values() for v in (x.values() if isinstance(x, dict) else [x])])
        # A relative error moves by at most the relative rounding of the photographs. Random signs cancel light, and the
        # photograph of |pattern| is at most 1/sqrt(pixels) of it in norm: at most 32 times the rounding.
        assert np.abs(flat(whole) - flat(dealt)).max() <= 32 * ROUNDING


def test_solve(folder):
    for count in (1, 2, 3, 4):
        told = ranks(count, "solve", "scene.h5", "--wanted", "whole.pfm", "-o", "light.pfm", "--json", "solved.json", folder=folder)
        solved = json.loads((folder / "solved.json").read_text())
        light = read_pfm(folder / "light.pfm")
        assert light.min() >= 0 and light.max() <= 1
        assert solved["ranks"] == count and solved["converged"]
        assert solved["residual"] <= 0.01 and solved["applications"] <= 50
        assert "residual" in told.stdout
        # What the command tells is what the scene shows under its light.
        run(SYMRIG, "relight", "scene.h5", "--light", "light.pfm", "-o", "again.pfm", folder=folder)
        whole, again = read_pfm(folder / "whole.pfm"), read_pfm(folder / "again.pfm")
        residual = np.linalg.norm(again.astype(float) - whole) / np.linalg.norm(whole)
        assert abs(residual - solved["residual"]) <= 2 * ROUNDING


def test_the_page_names_every_command_and_option(folder):
    page = pathlib.Path(HOWTO).read_text(encoding="utf-8")
    commands = re.findall(r"^  ([a-z]+) {2,}", run(MPI, "--help", folder=folder).stdout, re.MULTILINE)
    assert set(commands) >= {"relight", "evaluate", "solve", "polish"}
    for command in commands:
        assert f"symrig-mpi {command} " in page, command
    options = set(re.findall(r"--[a-z]+", run(MPI, "solve", "--help", folder=folder).stdout)) - {"--help", "--output"}
    assert options == {"--wanted", "--most", "--tolerance", "--applications", "--json"}
    for option in options:
        assert f"- `{option} " in page, option
    options = set(re.findall(r"--[a-z]+", run(MPI, "polish", "--help", folder=folder).stdout))
    options -= {"--help", "--output", "--rig", "--polish", "--keep"}  # the last three are capture's, in the example
    assert options == {"--log", "--steps", "--parts", "--json"}
    for option in options:
        assert f"- `{option} " in page, option


def errors_of(path):
    with h5py.File(path) as scene:
        return json.loads(scene.attrs["capture"])["estimated_error"]


def content(path):
    """Every bit that a scene file holds. HDF5 adds the time at which it was written."""
    found = {}
    with h5py.File(path) as scene:
        found.update({f"@{key}": np.asarray(value).tobytes() for key, value in scene.attrs.items()})
        scene.visititems(lambda name, one: found.update({name: one[()].tobytes()} if isinstance(one, h5py.Dataset) else {}))
    assert len(found) > 30
    return found


def test_polish(folder):
    """Errors are about those of a capture that has polished itself, on any number of ranks."""
    told = {}
    for count in (1, 2, 3, 4):
        words = ("polish", "rough.h5", "--json", "polished.json", "-o")
        # The same parts on other ranks are the same bits.
        ranks(count, *words, f"parts-{count}.h5", "--parts", "12", folder=folder)
        assert content(folder / f"parts-{count}.h5") == content(folder / "parts-1.h5"), count
        done = ranks(count, *words, f"polished-{count}.h5", folder=folder)
        told[count] = json.loads((folder / "polished.json").read_text())
        assert told[count]["ranks"] == told[count]["polish"]["parts"] == count
        assert f"polished-{count}.h5: refitted to " in done.stdout
        # Other parts are the same but for rounding: of the sums, far below that of the numbers when they are packed as halves.
        # One that falls on the other side there moves T by up to its own rounding, 2^-10 of each leaf's light (TransportTensor).
        run(SYMRIG, "relight", f"polished-{count}.h5", "--light", "letters", "-o", f"relit-{count}.pfm", folder=folder)
        one, dealt = read_pfm(folder / "relit-1.pfm"), read_pfm(folder / f"relit-{count}.pfm")
        assert np.abs(dealt - one).max() <= 2.0**-10 * np.abs(one).max(), count
        misfits = [told[n]["polish"]["misfit"]["after"] for n in (1, count)]
        assert abs(misfits[1] - misfits[0]) <= 1e-4 * misfits[0], count
    polish = told[1]["polish"]
    assert polish["steps"] == 2 and polish["misfit"]["after"] < polish["misfit"]["before"]
    alone = run(MPI, "polish", "rough.h5", "-o", "alone.h5", folder=folder)
    assert content(folder / "alone.h5") == content(folder / "polished-1.h5"), alone.stdout
    # The capture polishes before leaves are merged and rounded, so the two differ. Both are far below what was not polished.
    run(SYMRIG, "capture", "--rig", NOISY, "--polish", "2", "-o", "capture.h5", folder=folder)
    rig = ("--rig", NOISY, "--json", "true.json")
    true = {}
    for name in ("rough", "polished-1", "capture"):
        run(SYMRIG, "evaluate", f"{name}.h5", *rig, folder=folder)
        true[name] = json.loads((folder / "true.json").read_text())["error"]["indirect"]
    gained = true["rough"] - true["capture"]
    assert gained > 0.05 * true["rough"], true
    assert true["rough"] - true["polished-1"] > gained / 2, true
    # What is stated is estimated anew.
    assert errors_of(folder / "polished-1.h5") == told[1]["estimated_error"] != errors_of(folder / "rough.h5")


def test_polish_refuses_in_one_line(folder):
    (folder / "elsewhere-log").mkdir()
    run(SYMRIG, "capture", "--rig", NOISY + "&seed=5", "--keep-log", "-o", "elsewhere-log/rough.h5", folder=folder)
    before = set(os.listdir(folder))
    for code, text, *call in [
        (4, "scene.h5.log: no such file", "scene.h5"),
        (4, "no such file", "none.h5", "--log", "rough.h5.log"),
        (4, "is not the log of rough.h5", "rough.h5", "--log", "elsewhere-log/rough.h5.log"),
        (4, "is not a photograph log", "rough.h5", "--log", "whole.pfm"),
        (2, "0 is not a number of steps", "rough.h5", "--steps", "0"),
        (2, "2 parts cannot be dealt to 3 ranks", "rough.h5", "--parts", "2"),
        (2, "--stps", "rough.h5", "--stps", "1"),
    ]:
        done = ranks(3, "polish", *call, "-o", "no.h5", folder=folder, code=code)
        assert len(ours(done.stderr)) == 1 and text in done.stderr, done.stderr
        assert done.stdout == ""
    done = ranks(3, "polish", "rough.h5", "-o", "rough.h5", folder=folder, code=2)
    assert len(ours(done.stderr)) == 1, done.stderr
    # One rank has another scene under this name, with its log.
    words = (MPI, "polish", "rough.h5", "-o", "no.h5")
    done = run(MPIRUN, "-n", 1, *words, ":", "-n", 1, "--wdir", "elsewhere-log", *words, folder=folder, code=4)
    assert len(ours(done.stderr)) == 1 and "different scenes or logs" in done.stderr, done.stderr
    assert set(os.listdir(folder)) == before


def test_polish_refuses_a_log_that_is_written(folder):
    """As a capture has it: locked for itself."""
    with open(folder / "rough.h5.log", "r+b") as log:
        fcntl.flock(log, fcntl.LOCK_EX)
        done = ranks(2, "polish", "rough.h5", "-o", "no.h5", folder=folder, code=4)
    assert len(ours(done.stderr)) == 1 and "another process is writing to it" in done.stderr, done.stderr
    assert not (folder / "no.h5").exists()


def test_one_line_for_bad_input(folder):
    before = set(os.listdir(folder))
    black = folder / "black.pfm"
    black.write_bytes(b"Pf\n32 32\n-1.0\n" + bytes(4 * 32 * 32))
    small = folder / "small.pfm"
    small.write_bytes(b"Pf\n8 8\n-1.0\n" + bytes(4 * 64))
    words = ("solve", "scene.h5", "-o", "no.pfm", "--wanted")
    for code, text, *call in [
        (4, "no such file", "relight", "none.h5", "--light", "white", "-o", "no.pfm"),
        (4, "dark everywhere", *words, "black.pfm"),
        (4, "is 8x8", *words, "small.pfm"),
        (4, "no such file", *words, "none.pfm"),
        (2, "tolerance", *words, "whole.pfm", "--tolerance", "0"),
        (2, "largest light", *words, "whole.pfm", "--most", "0"),
        (2, "--wantd", "solve", "scene.h5", "--wantd", "whole.pfm", "-o", "no.pfm"),
        (2, "no command 'solv'", "solv"),
    ]:
        done = ranks(3, *call, folder=folder, code=code)
        assert len(ours(done.stderr)) == 1 and text in done.stderr, done.stderr
        assert done.stdout == ""
    assert set(os.listdir(folder)) == before | {"black.pfm", "small.pfm"}


def test_a_rank_that_cannot_read_the_scene(folder):
    (folder / "elsewhere").mkdir()
    words = (MPI, "relight", "scene.h5", "--light", "white", "-o", "no.pfm")
    done = run(MPIRUN, "-n", 1, *words, ":", "-n", 1, "--wdir", "elsewhere", *words, folder=folder, code=4)
    assert len(ours(done.stderr)) == 1 and "rank 1 on" in done.stderr and "scene.h5: no such file" in done.stderr, done.stderr
    run(SYMRIG, "capture", "--rig", RIG + "&seed=2", "-o", "elsewhere/scene.h5", folder=folder)
    done = run(MPIRUN, "-n", 1, *words, ":", "-n", 1, "--wdir", "elsewhere", *words, folder=folder, code=4)
    assert len(ours(done.stderr)) == 1 and "different scenes" in done.stderr, done.stderr
    assert not (folder / "no.pfm").exists()


def test_a_full_disk(folder):
    """A file that may not grow is to the command what a full disk is. MPI's own files of shared memory would not fit either."""
    limited = ("bash", "-c", 'ulimit -f 3; exec "$@"', "-", MPI, "relight", "scene.h5", "--light", "white", "-o", "no.pfm")
    done = run("env", "PMIX_MCA_gds=hash", MPIRUN, "--mca", "btl", "self,tcp", "-n", 2, *limited, folder=folder, code=4)
    assert len(ours(done.stderr)) == 1 and "cannot be written" in done.stderr, done.stderr
    assert not [name for name in os.listdir(folder) if "no.pfm" in name]


def children(process):
    """The ranks that mpirun started, in the order of their ranks."""
    found = {}
    for entry in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            variables = dict(v.split(b"=", 1) for v in (entry / "environ").read_bytes().split(b"\0") if b"=" in v)
            parent = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
        except OSError:
            continue
        if parent == process.pid and b"OMPI_COMM_WORLD_RANK" in variables:
            found[int(variables[b"OMPI_COMM_WORLD_RANK"])] = int(entry.name)
    return [found[rank] for rank in sorted(found)]


def polishing(process):
    """Every rank has the log open: the polish has begun."""
    def has_the_log(pid):
        try:
            return any(os.readlink(fd).endswith(".h5.log") for fd in pathlib.Path(f"/proc/{pid}/fd").iterdir())
        except OSError:
            return False

    found = children(process)
    return len(found) == 3 and all(has_the_log(pid) for pid in found)


def test_a_rank_that_is_killed(folder):
    """The others end with a line each, and no picture is half-written."""
    many = folder / "many"
    many.mkdir()
    for k in range(4000):
        (many / f"{k:04}.pfm").symlink_to("../whole.pfm")
    for victim in (1, 0):
        out = folder / f"killed-{victim}"
        call = [*MPIRUN_PATIENT, "-n", "3", MPI, "relight", "scene.h5", "--lights", "many", "--format", "pfm", "-o", str(out)]
        with subprocess.Popen(call, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
            while process.poll() is None and not list(out.glob("[0-9]*.pfm")):
                time.sleep(0.01)
            assert process.poll() is None, "it ended before it could be killed"
            os.kill(children(process)[victim], signal.SIGKILL)
            stdout, stderr = process.communicate(timeout=120)
        assert process.returncode != 0 and stdout == ""
        assert "signal 9" in stderr, stderr
        lines = ours(stderr)
        assert len(lines) == 2 and all("another rank died" in line for line in lines), stderr
        pictures = list(out.glob("[0-9]*.pfm"))
        assert 0 < len(pictures) < 4000
        assert {picture.stat().st_size for picture in pictures} == {(folder / "whole.pfm").stat().st_size}


def test_a_rank_that_is_killed_while_it_polishes(folder):
    """The others end with a line each, and there is no file."""
    before = set(os.listdir(folder))
    for victim in (2, 0):
        call = [*MPIRUN_PATIENT, "-n", "3", MPI, "polish", "rough.h5", "--steps", "20", "-o", "no.h5"]
        with subprocess.Popen(call, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
            while process.poll() is None and not polishing(process):
                time.sleep(0.01)
            assert process.poll() is None, "it ended before it could be killed"
            os.kill(children(process)[victim], signal.SIGKILL)
            stdout, stderr = process.communicate(timeout=120)
        assert process.returncode != 0 and stdout == ""
        lines = ours(stderr)
        assert len(lines) == 2 and all("another rank died" in line for line in lines), stderr
    assert set(os.listdir(folder)) == before


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        run(SYMRIG, "capture", "--rig", RIG, "-o", "scene.h5", folder=folder)
        run(SYMRIG, "capture", "--rig", NOISY, "--polish", "0", "--keep-log", "-o", "rough.h5", folder=folder)
        for test in [value for key, value in globals().items() if key.startswith("test_")]:
            print(test.__name__, flush=True)
            test(folder)


if __name__ == "__main__":
    main()
