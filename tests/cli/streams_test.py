# SPDX-License-Identifier: Apache-2.0
"""What surrounds a command: closed and full descriptors, names with bytes that a terminal obeys, pipes in the place of files, a closed
terminal, too little memory, a folder that goes away.

usage: streams_test.py SYMRIG

Every command meets one kind of closed descriptor and of odd name after the other, and every kind meets several commands. With
SYMRIG_LONG in the environment, every command meets every kind.
"""

import json
import os
import pathlib
import re
import resource
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time

PATIENCE = 300  # seconds; ends a broken test, decides nothing
LONG = "SYMRIG_LONG" in os.environ
SMALL = "sim:vgroove-textured?size=12x17&noise=off"
SLOW = "sim:gummy?size=160x160"
PROGRAM = 'symrig = 1\n[program]\npatterns = 8\nbracket = ["1 ms", "4 ms"]\n'
GOOD = (
    ["inspect", "in.h5"],
    ["evaluate", "in.h5", "--rig", SMALL],
    ["relight", "in.h5", "--light", "white", "-o", "out.exr"],
    ["report", "in.h5", "-o", "out.html"],
    ["capture", "--rig", SMALL, "-o", "out.h5"],
    ["calibrate", "--rig", "sim:plane?size=8x8"],
    ["lint", "p.toml"],
    ["compile", "p.toml", "-o", "out.symprog"],
    ["run", "p.toml", "--device", "sim:"],
    ["trace", "p.toml"],
    ["list"],
    ["info", "--device", "sim:"],
    ["identify", "--device", "sim:"],
    ["--version"],
    ["--help"],
)
BAD = (
    [],
    ["nonsense"],
    ["capture"],
    ["capture", "--rig", "sim:nothing", "-o", "out.h5"],
    *(["inspect", "nothing.h5"], ["evaluate", "nothing.h5"], ["report", "nothing.h5", "-o", "out.html"]),
    *(["relight", "nothing.h5", "--light", "white", "-o", "out.exr"], ["dual", "nothing.h5", "--light", "white", "-o", "out.exr"]),
    *(["fit", "--from", "nothing", "-o", "out.h5"], ["calibrate", "--from", "nothing"], ["bench", "--scenes", "nothing"], ["merge", "nothing", "-o", "out.exr"]),
    *(["lint", "nothing.toml"], ["compile", "nothing.toml", "-o", "out.symprog"], ["run", "nothing.toml"], ["trace", "nothing.json"]),
    *(["info", "--device", "unix:nothing"], ["identify", "--device", "unix:nothing"], ["selftest", "--device", "unix:nothing"]),
    *(["list", "--device", "nothing:"], ["flash", "nothing.uf2"], ["conformance", "unix:nothing"]),
)


class Here:
    def __init__(self, symrig, folder):
        self.symrig, self.folder = symrig, pathlib.Path(folder)
        (self.folder / "p.toml").write_text(PROGRAM)
        assert self.run(["capture", "--rig", SMALL, "-o", "in.h5"]).returncode == 0

    def run(self, words, **more):
        more = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "stdin": subprocess.DEVNULL, "timeout": PATIENCE} | more
        return subprocess.run([self.symrig, *words], cwd=self.folder, check=False, **more)

    def shell(self, words, redirections):
        """As a shell starts it: >&- closes."""
        return subprocess.run(
            ["/bin/sh", "-c", f'exec "$0" "$@" {redirections}', self.symrig, *words],
            cwd=self.folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=PATIENCE, check=False,
        )

    def start(self, words, **more):
        return subprocess.Popen([self.symrig, *words], cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, **more)

    def tidy(self):
        for path in self.folder.iterdir():
            if path.name.startswith("out"):
                path.unlink()


def some(number, kinds):
    """The kinds that the command of this number meets."""
    return kinds if LONG else (kinds[number % len(kinds)],)


def descriptors(here):
    for number, words in enumerate(BAD):
        plain = here.run(words).returncode
        assert plain > 0, words
        for redirections in some(number, ("2>&-", "2>/dev/full", ">&- 2>&-", "<&- >&- 2>&-")):
            done = here.shell(words, redirections)
            assert done.returncode == plain, (words, redirections, done)
    for number, words in enumerate(GOOD):
        here.tidy()
        for redirections in some(number, (">&-", ">/dev/full")):
            done = here.shell(words, redirections)
            here.tidy()
            assert done.returncode == 4 and b"standard output cannot be written" in done.stderr, (words, redirections, done)
            assert done.stderr.count(b"\n") == 1, done
        for redirections in some(number, ("2>&-", "2>/dev/full", "<&-")):
            done = here.shell(words, redirections)
            here.tidy()
            assert done.returncode == 0, (words, redirections, done)
    commands = re.findall(r"^  (\w+) {2,}\w", here.run(["--help"]).stdout.decode().split("Example:")[0], re.MULTILINE)
    assert len(commands) >= 19, commands
    for command in commands:
        assert here.shell([command, "--help"], ">/dev/full").returncode == 4, command


def no_file_becomes_a_stream(here):
    """The first file that a command opens does not get the number of a closed descriptor."""
    words = ["capture", "--rig", SMALL, "-o", "out.h5", "--keep-log", "--json", "out.json"]
    assert here.run(words).returncode == 0
    sound = json.loads((here.folder / "out.json").read_text())["patterns"]
    for redirections in (">&-", "2>&-", "<&-", "<&- >&- 2>&-"):
        here.tidy()
        here.shell(words, redirections)
        here.run([*words, "--resume"])
        replayed = json.loads((here.folder / "out.json").read_text())["replayed"]
        assert replayed == sound, f"{redirections}: the log holds {replayed} of {sound} photographs"
    here.tidy()


NAMES = (b"\x1b[31mred", b"bell\x07", b"\xc2\x9b31m", b"\x9b31m", b"bytes\xff\xfe", b"\xe2\x80\xaeturned", b"\xe2\x81\xa6", b"line\nbreak", b"\r", b"\x7f")


def obeyed(text):
    """Whether a terminal would do something else than show it."""
    try:
        shown = text.decode()
    except UnicodeDecodeError:
        return True
    return any(c not in "\n\t" and (ord(c) < 32 or 127 <= ord(c) < 160 or c in "\u202e\u2066") for c in shown)


def names(here):
    scene, program = (here.folder / "in.h5").read_bytes(), PROGRAM.encode()
    for number, name in enumerate(NAMES):
        scene_name, program_name, page = name + b".h5", name + b".toml", b"out" + name + b".html"
        (here.folder / os.fsdecode(scene_name)).write_bytes(scene)
        (here.folder / os.fsdecode(program_name)).write_bytes(program)
        there = ([b"inspect", scene_name], [b"report", scene_name, b"-o", page], [b"lint", program_name], [b"trace", program_name])
        missing = [[*words, b"x" + name] for words in ([b"inspect"], [b"lint"], [b"trace"], [b"run"], [b"fit", b"-o", b"out.h5", b"--from"])]
        missing += [[b"capture", b"-o", b"out.h5", b"--rig", name], [name], [b"--" + name], [b"info", b"--device", b"unix:" + name]]
        missing += [[b"list", b"--device", b"unix:" + name], [b"relight", b"in.h5", b"--light", name, b"-o", b"out.exr"]]
        every = 1 if LONG else 3
        for words in (*there, *missing)[number % every :: every]:
            done = here.run(words)
            assert not obeyed(done.stdout) and not obeyed(done.stderr), (words, done)
            assert done.returncode == 0 or (words in missing and done.returncode > 0), (words, done)
            assert done.stderr.count(b"\n") == (done.returncode != 0), (words, done)
        for words in some(number, ([b"lint", program_name, b"--json", b"-"], [b"list", b"--device", b"unix:" + name, b"--json", b"-"])):
            done = here.run(words)
            assert done.returncode == 0 and json.loads(done.stdout.decode()), (words, done)
        (here.folder / os.fsdecode(scene_name)).unlink()
        (here.folder / os.fsdecode(program_name)).unlink()
    here.tidy()


def pipes(here):
    """No file that is read can make a command wait for the other end of a pipe."""
    for name in ("pipe.h5", "pipe.toml", "pipe.json", "pipe.pfm", "pipe.uf2", "firmware.json"):
        os.mkfifo(here.folder / name)
    (here.folder / "firmware.uf2").write_bytes(b"UF2\n" * 128)
    for folder, file in (("pictures", "00.png"), ("settings", "capture.toml"), ("drive", "INFO_UF2.TXT")):
        (here.folder / folder).mkdir()
        os.mkfifo(here.folder / folder / file)
    (here.folder / "rig.toml").write_text('symrig = 1\n[board]\nuri = "unix:x"\n[camera]\nsensor = "pipe.toml"\n[projector]\n')
    (here.folder / "scan.toml").write_text(PROGRAM + '[rig]\ncamera = "./pipe.toml"\n')
    for words in (
        *(["inspect", "pipe.h5"], ["report", "pipe.h5", "-o", "out.html"], ["evaluate", "pipe.h5"]),
        *(["relight", "pipe.h5", "--light", "white", "-o", "out.exr"], ["relight", "in.h5", "--light", "pipe.pfm", "-o", "out.exr"]),
        *(["dual", "in.h5", "--light", "pipe.pfm", "-o", "out.exr"], ["capture", "--rig", "pipe.toml", "-o", "out.h5"]),
        *(["capture", "--rig", "rig.toml", "-o", "out.h5"], ["calibrate", "--rig", "pipe.toml"], ["calibrate", "--from", "pictures"]),
        *(["calibrate", "--from", "settings"], ["calibrate", "--sensor", "settings"], ["fit", "--from", "pictures", "-o", "out.h5"]),
        *(["lint", "pipe.toml"], ["lint", "scan.toml"], ["lint", "p.toml", "--board", "pipe.json"], ["compile", "pipe.toml", "-o", "out"]),
        *(["run", "pipe.toml", "--device", "sim:"], ["trace", "pipe.json"], ["flash", "pipe.uf2", "--verify"]),
        *(["flash", "firmware.uf2", "--verify"], ["flash", "firmware.uf2", "--drive", "drive", "--wait", "0"]),
    ):
        done = here.run(words, timeout=PATIENCE)
        assert done.returncode in (2, 3, 4) and done.stderr.count(b"\n") == 1, (words, done)


def begun(here, words, **more):
    """A capture that has photographs in its log."""
    process = here.start(words, **more)
    log = here.folder / "out.h5.log"
    end = time.monotonic() + PATIENCE
    while not log.exists() or log.stat().st_size < 1_000_000:
        assert time.monotonic() < end and process.poll() is None, process.communicate()
        time.sleep(0.002)
    return process


def hang_up(here):
    """The kernel says it, and the shell says it again."""
    words = ["capture", "--rig", SLOW, "-o", "out.h5"]
    process = begun(here, words)
    for _ in range(2):
        process.send_signal(signal.SIGHUP)
    err = process.communicate(timeout=PATIENCE)[1]
    assert process.returncode == 5 and b"stopped" in err and b"out.h5.log keeps" in err, (process.returncode, err)
    here.tidy()
    process = begun(here, words, preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))  # as nohup does
    process.send_signal(signal.SIGHUP)
    time.sleep(0.5)
    assert process.poll() is None, process.communicate()
    process.send_signal(signal.SIGTERM)
    err = process.communicate(timeout=PATIENCE)[1]
    assert process.returncode == 5 and b"out.h5.log keeps" in err, (process.returncode, err)
    here.tidy()


def a_log_that_goes_away(here):
    """What is not there any more is not promised."""
    process = begun(here, ["capture", "--rig", SLOW, "-o", "out.h5"])
    (here.folder / "out.h5.log").unlink()
    process.send_signal(signal.SIGINT)
    err = process.communicate(timeout=PATIENCE)[1]
    assert process.returncode == 5 and b"was deleted or moved" in err and b"keeps" not in err and b"--resume" not in err, err
    process = begun(here, ["capture", "--rig", SLOW, "-o", "out.h5"])
    (here.folder / "out.h5.log").rename(here.folder / "out.moved")
    (here.folder / "out.h5.log").write_text("of somebody else")
    process.send_signal(signal.SIGINT)
    err = process.communicate(timeout=PATIENCE)[1]
    assert b"was deleted or moved" in err and (here.folder / "out.h5.log").read_text() == "of somebody else", err
    here.tidy()


def memory(here):
    """A capture that runs out of memory says that its log stays."""
    seen, limit = 0, 80 << 20
    while limit < 8 << 30:
        done = here.run(
            ["capture", "--rig", "sim:gummy?size=256x256&channels=3", "-o", "out.h5", "--max-patterns", "40"],
            preexec_fn=lambda limit=limit: resource.setrlimit(resource.RLIMIT_AS, (limit, limit)),
        )
        log = here.folder / "out.h5.log"
        kept = log.stat().st_size if log.exists() else 0
        here.tidy()
        if done.returncode == 0:
            break
        if b"Sanitizer" in done.stderr:
            print("a sanitizer needs more than any limit allows")
            return
        # A machine with more processors needs more. Between too little and enough lies a factor of three.
        limit = limit * 8 // 7 if LONG else limit * 4 // 3
        if b"out of memory" in done.stderr and kept > 1_000_000:
            seen += 1
            assert done.returncode == 5 and b"out.h5.log keeps" in done.stderr and b"--resume" in done.stderr, done
            assert done.stderr.count(b"\n") == 1, done
    print(f"out of memory with photographs in the log: {seen} times")
    assert seen > 0, "at no limit the log had photographs"


def mute_board(here):
    """A virtual board's server that answers the first question and no other."""
    place = str(here.folder / "mute")
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(place)
        server.listen(1)
        process = here.start(["info", "--device", f"virtual:unix:{place}"])
        client = server.accept()[0]
        hello = struct.pack("<IQ", 1, 125_000_000) + b"mute"
        assert client.recv(5)[:1] == b"h"
        client.sendall(b"h" + struct.pack("<I", len(hello)) + hello)
        out, err = process.communicate(timeout=PATIENCE)  # its patience is 15 s; it was two minutes a question
        client.close()
    assert process.returncode == 3 and b"no answer for 15 s" in err and err.count(b"\n") == 1, (process.returncode, out, err)


def silent_board(here):
    """A server that takes the connection and says nothing."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        done = here.run(["info", "--device", f"virtual:tcp:127.0.0.1:{server.getsockname()[1]}"])
    assert done.returncode == 3 and b"no answer for 5 s" in done.stderr and done.stderr.count(b"\n") == 1, done


def main():
    with tempfile.TemporaryDirectory() as folder:
        here = Here(os.path.abspath(sys.argv[1]), folder)
        for check in (descriptors, no_file_becomes_a_stream, names, pipes, hang_up, a_log_that_goes_away, memory, mute_board, silent_board):
            start = time.monotonic()
            check(here)
            print(f"{check.__name__}: {time.monotonic() - start:.1f} s")


main()
