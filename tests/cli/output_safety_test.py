# SPDX-License-Identifier: Apache-2.0
"""Outputs against inputs: every command, every output, and everything that could stand in its place.

An output that is an input, two outputs that are one file, an output that is a folder, device, pipe or socket, and an output with the
suffix of another format: refused in one line before any work, and the folder is as it was.

Every output of every command meets one way of each kind, and the ways take turns. With SYMRIG_LONG in the environment, it meets
them all.

usage: output_safety_test.py SYMRIG
"""

import collections
import contextlib
import dataclasses
import os
import pathlib
import re
import socket
import stat
import subprocess
import sys
import tempfile

LONG = "SYMRIG_LONG" in os.environ
SMALL = "sim:vgroove-textured?size=12x17&noise=off"
OWN_CAMERA = "sim:vgroove-textured?size=12x17&noise=off&camera=48x68"
PROGRAM = 'symrig = 1\n[program]\npatterns = 8\nbracket = ["1 ms", "4 ms"]\n'
RIG = 'symrig = 1\nmap = "map.exr"\n[board]\nuri = "unix:no-board.sock"\n[camera]\nbits = 12\nfull_well = 20000\nread_noise = 6\npedestal = 64\n[projector]\n'


@dataclasses.dataclass
class Job:
    """A command line with {output} for each output, the natural names of its outputs, and what it reads."""

    words: list
    outputs: dict  # option or derived file -> natural name
    inputs: list = dataclasses.field(default_factory=list)
    derived: dict = dataclasses.field(default_factory=dict)  # file -> (option, suffix): named by the program itself
    anew: dict = dataclasses.field(default_factory=dict)  # option -> an input that it measures anew, and may replace
    ends: int = 0  # exit code with these outputs; None: not run to its end here


JOBS = [
    Job(["capture", "--rig", SMALL], {"-o": "scene.h5", "--json": "out.json"}, derived={"-o": ".log"}),
    Job(["capture", "--rig", "rig.toml"], {"-o": "scene.h5", "--json": "out.json"}, ["rig.toml", "map.exr"], {"-o": ".log"}, ends=3),
    Job(
        ["capture", "--rig", OWN_CAMERA, "--registration", "registration.h5"],
        {"-o": "scene.h5", "--json": "out.json"},
        ["registration.h5"],
        {"-o": ".log"},
    ),
    Job(
        ["capture", "--rig", "registered.toml"],
        {"-o": "scene.h5", "--json": "out.json"},
        ["registered.toml", "registration.h5"],
        {"-o": ".log"},
        ends=3,
    ),
    Job(["relight", "in.h5", "--light", "light.pfm"], {"-o": "out.exr"}, ["in.h5", "light.pfm"]),
    Job(["relight", "in.h5", "--lights", "lights.y4m"], {"-o": "out.y4m"}, ["in.h5", "lights.y4m"]),
    Job(["dual", "in.h5", "--light", "light.pfm"], {"-o": "out.png"}, ["in.h5", "light.pfm"]),
    Job(["evaluate", "in.h5", "--rig", SMALL], {"--json": "out.json"}, ["in.h5"]),
    Job(["evaluate", "in.h5", "--rig", "rig.toml"], {"--json": "out.json"}, ["in.h5", "rig.toml", "map.exr"], ends=3),
    Job(
        ["evaluate", "in.h5", "--rig", "rig.toml", "--registration", "registration.h5"],
        {"--json": "out.json"},
        ["in.h5", "rig.toml", "map.exr", "registration.h5"],
        ends=3,
    ),
    Job(["inspect", "in.h5"], {"--json": "out.json"}, ["in.h5"]),
    Job(["export", "in.h5"], {"--dense": "T.npy"}, ["in.h5"]),
    Job(["import", "T0.npy"], {"-o": "out.h5", "--json": "out.json"}, ["T0.npy"]),
    Job(["report", "in.h5"], {"-o": "out.html"}, ["in.h5"]),
    Job(["view", "in.h5"], {"--export": "out.html"}, ["in.h5"]),
    Job(["align", "--rig", "sim:plane?size=24x24&noise=off", "--updates", "1"], {"--json": "out.json"}),
    Job(["align", "--rig", "rig.toml", "--updates", "1"], {"--json": "out.json"}, ["rig.toml", "map.exr"], ends=3),
    Job(
        ["calibrate", "--rig", SMALL],
        {"-o": "new.exr", "--uncertainty": "sigma.pfm", "--report": "out.html", "--json": "out.json"},
    ),
    Job(
        ["calibrate", "--from", "photographs"],
        {"-o": "new.exr", "--uncertainty": "sigma.pfm", "--report": "out.html", "--json": "out.json"},
        ["photographs/00.png", "photographs/capture.toml", "photographs/response.toml"],
        ends=4,
    ),
    Job(
        ["calibrate", "--rig", "rig.toml"],
        {"-o": "new.exr", "--json": "out.json"},
        ["rig.toml", "map.exr"],
        anew={"-o": "map.exr"},
        ends=3,
    ),
    Job(
        ["calibrate", "--rig", OWN_CAMERA],
        {"-o": "new.h5", "--report": "out.html", "--json": "out.json"},
    ),
    Job(
        ["calibrate", "--rig", "registered.toml"],
        {"-o": "new.h5", "--json": "out.json"},
        ["registered.toml", "registration.h5"],
        anew={"-o": "registration.h5"},
        ends=3,
    ),
    Job(["calibrate", "--rig", SMALL], {"--levels": "levels.toml", "--json": "out.json"}),
    Job(
        ["calibrate", "--sensor", "photographs"],
        {"-o": "sensor.toml", "--response": "new.toml", "--json": "out.json"},
        ["photographs/00.png", "photographs/capture.toml", "photographs/response.toml"],
        ends=4,
    ),
    Job(["calibrate", "--sensor", "--rig", "sim:plane?size=32x32"], {"-o": "sensor.toml", "--json": "out.json"}),
    Job(
        ["calibrate", "--sensor", "--rig", "measured.toml"],
        {"-o": "sensor.toml", "--response": "new.toml", "--json": "out.json"},
        ["measured.toml", "known.toml"],
        anew={"-o": "known.toml"},
        ends=3,
    ),
    Job(
        ["fit", "--from", "photographs"],
        {"-o": "fit.h5", "--json": "out.json"},
        ["photographs/00.png", "photographs/capture.toml"],
        ends=4,
    ),
    Job(
        ["merge", "photographs", "--response", "photographs/response.toml"],
        {"-o": "radiance.exr", "--variance": "variance.exr", "--valid": "valid.png", "--json": "out.json"},
        ["photographs/00.png", "photographs/capture.toml", "photographs/response.toml"],
        ends=4,
    ),
    Job(
        ["bench", "--quick", "--scenes", "plane", "--size", "8x8", "--algorithms", "brute", "--no-memory"],
        {"--html": "out.html", "--json": "out.json", "--csv": "out.csv"},
    ),
    Job(["list"], {"--json": "out.json"}),
    Job(["info", "--device", "sim:"], {"--json": "out.json"}),
    Job(["selftest", "--device", "sim:", "--pings", "1"], {"--json": "out.json"}),
    Job(["lint", "p.toml", "--board", "board.json"], {"--json": "out.json"}, ["p.toml", "board.json"], ends=4),
    Job(["lint", "p.toml"], {"--json": "out.json"}, ["p.toml"]),
    Job(["compile", "p.toml"], {"-o": "out.symprog", "--json": "out.json"}, ["p.toml"]),
    Job(["run", "p.toml", "--device", "sim:"], {"-o": "out.json", "--vcd": "out.vcd"}, ["p.toml"]),
    Job(
        ["trace", "receipt.json"],
        {"--vcd": "out.vcd", "--wavedrom": "out.json", "--differences": "out.csv"},
        ["receipt.json"],
    ),
    Job(["trace", "p.toml", "--compare", "capture.vcd"], {"--differences": "out.csv"}, ["p.toml", "capture.vcd"], ends=4),
    Job(["conformance", "sim:", "--filter", "^hello"], {"--json": "out.json"}, ends=None),
]

# Options with a value that name no file to write. A new option belongs here or into JOBS.
NO_OUTPUT = """--rig --registration --algorithm --tolerance --dual-threshold --max-patterns --max-seconds --target-error --photograph-seconds --fit-seconds --split --polish --memory
--light --lights --format --exposure --from-view --to-view --views --mosaic --projector --from --sensor --hold-out --scenes --size --algorithms --tolerances --profiles
--seeds --noise --channels --device --camera --seconds --jumper --pings --wait --board --max-edges --filter --updates
--compare --channel --grid --listen --plug --revision --port --max-mb --pair --secret --progress --explain""".split()
# The copy must not land on the file that it is made of: tests/unit/board/firmware_file_test.cpp. A folder for a file that the
# program names by board and date; selftest reads none.
# A folder for frames must be new: tests/cli/sensor_rig_test.cpp.
OWN_RULE = {("flash", "--drive"), ("selftest", "--results"), ("calibrate", "--keep")}
# calibrate writes it, and merge reads it.
READ = {("merge", "--response")}


class Bench:
    def __init__(self, symrig, folder):
        self.symrig, self.folder, self.tried = symrig, folder, 0
        self.special_files, self.turns = [], collections.Counter()

    def some(self, kind, ways):
        """The ways of this kind that are tried now: the next one, or all."""
        self.turns[kind] += 1
        return ways if LONG or not ways else [ways[self.turns[kind] % len(ways)]]

    def path(self, name):
        return self.folder / name

    def run(self, words, **more):
        more = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "stdin": subprocess.DEVNULL} | more
        return subprocess.run([self.symrig, *words], cwd=self.folder, timeout=300, check=False, **more)

    def picture(self):
        """All that a refusal must leave alone."""
        found = {}
        for path in sorted(self.folder.rglob("*")):
            status = path.lstat()
            content = path.read_bytes() if stat.S_ISREG(status.st_mode) else b""
            link = os.readlink(path) if path.is_symlink() else ""
            found[str(path.relative_to(self.folder))] = (status.st_mode, status.st_ino, status.st_rdev, status.st_nlink, content, link)
        return found

    def refuses(self, words, codes, what, **more):
        self.tried += 1
        before = self.picture()
        done = self.run(words, **more)
        told = f"{what}: {' '.join(words)}\n  exit {done.returncode}: {done.stderr.decode(errors='replace')}"
        assert done.returncode in codes, told
        assert done.stderr.startswith(b"symrig ") and done.stderr.count(b"\n") == 1, told
        assert not done.stdout, told
        assert self.picture() == before, f"it changed the folder\n{told}"


def words_with(job, outputs):
    return job.words + [word for pair in outputs.items() for word in pair]


@contextlib.contextmanager
def placed(*paths):
    """Removes what a case has put there."""
    yield
    for path in paths:
        path.rmdir() if path.is_dir() and not path.is_symlink() else path.unlink()


def named(name, prefix):
    """A name with the same suffix in the same folder."""
    return prefix + pathlib.Path(name).name


def linked(make):
    def way(bench, read, link):
        make(bench.path(read), bench.path(link))
        return link, placed(bench.path(link))

    return way


# How an output can be an input: each gives the output's name, and removes what it made.
INPUT_WAYS = {
    "an output is an input": lambda bench, read, link: (read, placed()),
    "an output is an input by another path": lambda bench, read, link: (f"./{read}", placed()),
    "an output is an input, a hard link": linked(os.link),
    "an output is an input, a symbolic link": linked(os.symlink),
}


def against_inputs(bench, job, option):
    link = named(job.outputs[option], "link-")
    for read in [name for name in job.inputs if name != job.anew.get(option)]:
        for what in bench.some("input", list(INPUT_WAYS)):
            name, there = INPUT_WAYS[what](bench, read, link)
            with there:
                bench.refuses(words_with(job, job.outputs | {option: name}), {2}, what)


def link_to_nothing_yet(bench, other, link):
    bench.path(link).symlink_to(other)
    return link, placed(bench.path(link))


def hard_link(bench, other, link):
    bench.path(other).write_text("before")
    os.link(bench.path(other), bench.path(link))
    return link, placed(bench.path(other), bench.path(link))


# How two outputs can be one file.
OUTPUT_WAYS = {
    "two outputs have one name": lambda bench, other, link: (other, placed()),
    "two outputs, a link to what is not there": link_to_nothing_yet,
    "two outputs, hard link": hard_link,
}


def against_outputs(bench, job, option):
    link = named(job.outputs[option], "link-")
    for other in job.outputs:
        if other == option:
            continue
        for what in bench.some("output", list(OUTPUT_WAYS)):
            name, there = OUTPUT_WAYS[what](bench, job.outputs[other], link)
            with there:
                bench.refuses(words_with(job, job.outputs | {option: name}), {2}, what)


def bound_socket(path):
    with contextlib.closing(socket.socket(socket.AF_UNIX)) as one:
        one.bind(str(path))


# What is no regular file.
SPECIAL_FILES = {
    "a folder": pathlib.Path.mkdir,
    "a named pipe": os.mkfifo,
    "a socket": bound_socket,
    "a link to a device": lambda path: path.symlink_to("/dev/null"),
    "a device": lambda path: os.mknod(path, 0o666 | stat.S_IFCHR, os.makedev(1, 3)),  # as /dev/null
}


def may_make_devices(folder):
    if os.geteuid() != 0:
        return False
    try:
        SPECIAL_FILES["a device"](folder / "device")
    except PermissionError:
        return False
    (folder / "device").unlink()
    return True


def against_special_files(bench, job, option):
    # The log of a capture is named by the program: its place may be taken, too.
    for suffix in sorted({"", job.derived.get(option, "")}):
        path = bench.path(job.outputs[option] + suffix)
        for kind in bench.some("special file", bench.special_files):
            SPECIAL_FILES[kind](path)
            with placed(path):
                bench.refuses(words_with(job, job.outputs), {2, 4}, f"in the place of an output is {kind}")
    if option in job.derived:
        for other in set(job.outputs) - {option}:
            log = job.outputs[option] + job.derived[option]
            bench.refuses(words_with(job, job.outputs | {other: log}), {2}, "an output is the log")


def against_other_formats(bench, job, option):
    own = pathlib.Path(job.outputs[option]).suffix
    pictures = {".exr", ".pfm", ".png"}
    same = pictures if own in pictures else {own}
    if job.words[:2] == ["calibrate", "--rig"] and option == "-o":
        same = pictures | {".h5"}  # a map or a registration
    odd = [suffix for suffix in (".h5", ".png", ".json", ".toml", ".html", ".csv", ".vcd", ".symprog", ".PNG") if suffix.lower() not in same]
    for suffix in bench.some("suffix", odd):
        bench.refuses(words_with(job, job.outputs | {option: "odd" + suffix}), {2}, "the suffix of another format")


def against_redirection(bench, job):
    for name in bench.some("redirection", [*job.inputs, *(["already.json"] if "--json" in job.outputs else [])]):
        outputs = job.outputs | ({"--json": name} if name == "already.json" else {})
        bench.path("already.json").write_text("before")
        with placed(bench.path("already.json")), open(bench.path(name), "ab") as redirected:
            bench.tried += 1
            before = bench.picture()
            done = bench.run(words_with(job, outputs), stdout=redirected)
            told = f"standard output goes to {name}: {words_with(job, outputs)}\n  exit {done.returncode}: {done.stderr}"
            assert done.returncode == 2 and bench.picture() == before, told


def works(bench, job):
    """The same command line with outputs of its own: what is refused above is refused for its output."""
    if job.ends is None:
        return
    before = bench.picture().keys()
    for _ in range(2 if job.ends == 0 else 1):  # a second time, it replaces its own files
        done = bench.run(words_with(job, job.outputs))
        assert done.returncode == job.ends, (words_with(job, job.outputs), done.returncode, done.stderr)
    written = bench.picture().keys() - before
    assert written == (set(job.outputs.values()) if job.ends == 0 else set()), written
    for name in written:
        bench.path(name).unlink()


def writes_through(bench):
    """Text goes to descriptors that the shell has opened; binary files do not."""
    plain = bench.run(["inspect", "in.h5", "--json", "-"]).stdout
    assert plain.startswith(b"{")
    for name in ("/dev/stdout", "/proc/self/fd/1", "/dev/fd/1"):
        done = bench.run(["inspect", "in.h5", "--json", name])
        assert (done.returncode, done.stdout) == (0, plain), (name, done)
    read, write = os.pipe()
    done = bench.run(["inspect", "in.h5", "--json", f"/dev/fd/{write}"], pass_fds=[write])
    os.close(write)
    with open(read, "rb") as end:
        assert done.returncode == 0 and end.read() == plain, done
    bench.refuses(["inspect", "in.h5", "--json", "/dev/fd/77"], {2}, "this descriptor is not open for writing")
    bench.refuses(["run", "p.toml", "--device", "sim:", "-o", "-", "--vcd", "/dev/stdout"], {2}, "two outputs on standard output")
    for words in (["capture", "--rig", SMALL, "-o"], ["compile", "p.toml", "-o"], ["relight", "in.h5", "--light", "white", "-o"]):
        for name in ("-", "/dev/stdout"):
            bench.refuses([*words, name], {2}, "a binary file on standard output")
    done = bench.run(["compile", "p.toml", "-o", "program"])  # a name without suffix is a name
    assert done.returncode == 0, done.stderr
    bench.path("program").unlink()


def options_of(help_text):
    """Options that take a value: --json FILE."""
    return set(re.findall(r"^  (?:-\w,)?(--[\w-]+) (?!Excludes:|Needs:)(?=\S)", help_text, re.MULTILINE))


def table_is_complete(bench):
    """A command or an option that is new must be put into the table."""
    head = bench.run(["--help"]).stdout.decode()
    commands = set(re.findall(r"^  (\w+) {2,}\w", head.split("Example:")[0].split("ommands:", 1)[1], re.MULTILINE))
    listed = {job.words[0] for job in JOBS}
    assert commands - listed == {"identify", "flash", "help", "serve"}, (commands - listed, listed - commands)
    for command in sorted(commands):
        text = bench.run([command, "--help"]).stdout.decode()
        written = {name for job in JOBS if job.words[0] == command for name in job.outputs}
        for option in options_of(text.split("Example:")[0]):
            short = re.search(rf"^  (-\w),{option} ", text, re.MULTILINE)
            known = option in NO_OUTPUT or option in written or (short and short[1] in written) or (command, option) in OWN_RULE | READ
            assert known, f"{command} {option}: does it name a file to write? Put it into JOBS or NO_OUTPUT"


def prepare(bench):
    for name, text in {"p.toml": PROGRAM, "rig.toml": RIG, "map.exr": "a map", "board.json": "{}", "capture.vcd": "no VCD"}.items():
        bench.path(name).write_text(text)
    bench.path("photographs").mkdir()
    bench.path("photographs/00.png").write_text("a photograph")
    bench.path("photographs/response.toml").write_text("a response")
    bench.path("photographs/capture.toml").write_text('symrig = 1\nresponse = "response.toml"  # not "out.json"\n')
    head = b"{'descr': '<f4', 'fortran_order': False, 'shape': (16, 16), }".ljust(117) + b"\n"
    unit = b"".join(b"\0\0\x80?" if k % 17 == 0 else b"\0\0\0\0" for k in range(256))
    bench.path("T0.npy").write_bytes(b"\x93NUMPY\x01\0\x76\0" + head + unit)
    bench.path("lights.y4m").write_bytes(b"YUV4MPEG2 W17 H12 Cmono\n" + (b"FRAME\n" + b"\x80" * (17 * 12)) * 2)
    bench.path("light.pfm").write_bytes(b"Pf\n17 12\n-1.0\n" + b"\0\0\0\0" * (17 * 12))
    assert bench.run(["capture", "--rig", SMALL, "-o", "in.h5"]).returncode == 0
    registered = RIG.replace('map = "map.exr"', 'registration = "registration.h5"') + '[capture]\ngrid = "12x17"\n'
    bench.path("registered.toml").write_text(registered)
    bench.path("measured.toml").write_text(RIG.split("bits")[0] + 'sensor = "known.toml"\n[projector]\n')
    bench.path("known.toml").write_text("[sensor]\nbits = 12\npedestal = 64\ngain = 0.2\nread_noise = 6\n")
    found = bench.run(["calibrate", "--rig", OWN_CAMERA, "-o", "registration.h5"])
    assert found.returncode == 0, found.stderr
    assert bench.run(["run", "p.toml", "--device", "sim:", "-o", "receipt.json"]).returncode == 0


def main():
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(os.path.abspath(sys.argv[1]), pathlib.Path(folder))
        bench.special_files = [kind for kind in SPECIAL_FILES if kind != "a device" or may_make_devices(bench.folder)]
        table_is_complete(bench)
        prepare(bench)
        writes_through(bench)
        for job in JOBS:
            works(bench, job)
            against_redirection(bench, job)
            for option in job.outputs:
                against_inputs(bench, job, option)
                against_outputs(bench, job, option)
                against_special_files(bench, job, option)
                against_other_formats(bench, job, option)
        print(f"{bench.tried} refusals of {len(JOBS)} command lines")
        if "a device" not in bench.special_files:
            print("character devices could not be made, links to /dev/null were")


main()
