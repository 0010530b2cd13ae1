# SPDX-License-Identifier: Apache-2.0
"""Several pairs, one scene: two processes with a pair of sim:views2 each are captured as the single rig is.

usage: pairs_test.py SYMRIG
Exit code 77: h5py is not installed.
"""

import json
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

from scene_content import content
from served import Server, free_port, run

SCENE = "sim:views2?size=24x20"
RIG = """symrig = 1
name = "two-pairs"

[board]
uri = "sim:"

[[pair]]
{left}

[[pair]]
{right}

[capture]
pairs = "1x2"
{more}
"""


class Two:
    """Two pairs of a scene, the left one at a local socket and the right one over TCP with a secret."""

    def __init__(self, symrig, folder, scene=SCENE, more=""):
        self.symrig, self.scene, self.folder = symrig, scene, folder
        self.secret = folder / "secret"
        self.secret.write_text("a secret of both computers\n", encoding="ascii")
        self.secret.chmod(0o600)
        self.left = f"unix:{folder}/left.sock"
        self.right = f"tcp:127.0.0.1:{free_port()}"
        self.servers = [self.serve(0), self.serve(1)]
        self.rig = folder / "rig.toml"
        self.rig.write_text(
            RIG.format(left=f'uri = "{self.left}"', right=f'uri = "{self.right}"\nsecret = "secret"', more=more), encoding="ascii"
        )

    def serve(self, pair):
        more = ["--secret", str(self.secret)] if pair == 1 else []
        return Server(self.symrig, self.scene, (self.left, self.right)[pair], "--pair", f"{pair + 1}/1x2", *more)

    def capture(self, name, *more, rig=None, code=0):
        words = ("capture", "--rig", str(rig or self.rig), "-o", f"{self.folder}/{name}.h5", "--polish", "1", *more)
        return run(self.symrig, *words, code=code)

    def content(self, name):
        return content(f"{self.folder}/{name}.h5")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for server in self.servers:
            server.process.kill()
            server.process.wait()
        pathlib.Path(self.left.removeprefix("unix:")).unlink(missing_ok=True)


def captured_as_one_rig(symrig, folder):
    """Patterns and tensors, bit for bit; errors as well."""
    for keys in ("", "&noise=off", "&exposures=3&channels=3"):
        with Two(symrig, folder, SCENE + keys) as two:
            two.capture("joined", "--json", f"{folder}/joined.json")
            two.capture("single", "--json", f"{folder}/single.json", rig=SCENE + keys)
            joined, single = two.content("joined"), two.content("single")
            assert len(single) > 10
            assert joined == single, keys
            facts = [json.loads((folder / f"{name}.json").read_text()) for name in ("joined", "single")]
            for key in ("patterns", "frames", "patterns_per_level", "leaves_per_level", "tensor_bytes", "noise"):
                assert facts[0][key] == facts[1][key], (keys, key)
            errors = [
                json.loads(run(symrig, "evaluate", f"{folder}/{name}.h5", "--rig", SCENE + keys, "--json", "-").stdout)["error"]
                for name in ("joined", "single")
            ]
            assert errors[0] == errors[1], errors
            run(symrig, "evaluate", f"{folder}/joined.h5", "--rig", str(two.rig))
            assert [server.end() for server in two.servers] == [0, 0]


def goes_on_after_a_lost_pair(symrig, folder):
    """The right pair is killed during a capture, and started again."""
    scene = "sim:views2?size=48x48&noise=off"
    with Two(symrig, folder, scene) as two:
        two.capture("undisturbed")
        capture = subprocess.Popen(
            [symrig, "capture", "--rig", str(two.rig), "-o", f"{folder}/lost.h5", "--polish", "1", "--json", f"{folder}/lost.json"],
            stderr=subprocess.PIPE,
            text=True,
        )
        time.sleep(1)
        two.servers[1].process.kill()
        two.servers[1].process.wait()
        time.sleep(1)
        two.servers[1] = two.serve(1)
        assert capture.wait(timeout=600) == 0, capture.stderr.read()
        assert two.content("lost") == two.content("undisturbed")
        return json.loads((folder / "lost.json").read_text())["trouble"]


def resumes(symrig, folder):
    """A capture that was killed goes on from its log."""
    scene = "sim:views2?size=48x48"
    with Two(symrig, folder, scene) as two:
        two.capture("whole")
        words = [symrig, "capture", "--rig", str(two.rig), "-o", f"{folder}/resumed.h5", "--polish", "1"]
        log = folder / "resumed.h5.log"
        capture = subprocess.Popen(words, stderr=subprocess.DEVNULL)
        for _ in range(600):
            if log.exists() and log.stat().st_size > 200_000:
                break
            time.sleep(0.05)
        capture.send_signal(signal.SIGKILL)
        assert capture.wait() == -signal.SIGKILL
        two.capture("resumed", "--resume")
        assert two.content("resumed") == two.content("whole")


def refuses(symrig, folder):
    with Two(symrig, folder) as two:
        rig = folder / "bad.toml"

        def refused(words, code, left=None, right=None, more=""):
            rig.write_text(
                RIG.format(left=left or f'uri = "{two.left}"', right=right or f'uri = "{two.right}"\nsecret = "secret"', more=more),
                encoding="ascii",
            )
            error = two.capture("none", rig=rig, code=code).stderr
            assert words in error and error.count("\n") == 1, error

        other = folder / "other"
        other.write_text("another secret of one computer\n", encoding="ascii")
        other.chmod(0o600)
        refused("pair 2: " + two.right + " refuses: the shared secret is another one", 3, right=f'uri = "{two.right}"\nsecret = "other"')
        refused("secret: TCP needs a shared secret", 4, right=f'uri = "{two.right}"')
        refused("pair 1: " + two.left + " asks for no secret", 3, left=f'uri = "{two.left}"\nsecret = "secret"')
        two.secret.chmod(0o644)
        refused("other users can read this secret", 4)
        two.secret.chmod(0o600)
        refused("cannot be reached", 3, left=f'uri = "unix:{folder}/nothing"')
        refused("has the place 2, but 1 is needed", 2, left=f'uri = "{two.right}"\nsecret = "secret"', right=f'uri = "{two.left}"')
        serve = [symrig, "serve", SCENE, "--listen", f"unix:{folder}/x.sock"]
        for more, code, words in (
            (["--pair", "3/1x2"], 2, "--pair cannot be '3/1x2'"),
            (["--pair", "1"], 2, "--pair cannot be '1'"),
            (["--pair", "1/1x3"], 2, "cannot be dealt to 1x3 pairs"),
            (["--secret", str(two.secret)], 2, "--secret is for a pair"),
            (["--pair", "1/1x2", "--photographs"], 2, "cannot be combined"),
            (["--pair", "1/1x2", "--secret", f"{folder}/none"], 4, "none"),
        ):
            error = run(*serve, *more, code=code).stderr
            assert words in error and error.count("\n") == 1, error
        error = run(symrig, "serve", SCENE, "--listen", "tcp:127.0.0.1:1", "--pair", "1/1x2", code=2).stderr
        assert "needs a shared secret" in error, error


def serves_devices(symrig, folder):
    """A pair of devices whose camera is missing: its server lives, and the host hears what is wrong."""
    right = folder / "right.toml"
    right.write_text(
        'symrig = 1\n[camera]\ndevice = "/dev/no-camera"\nbits = 12\nfull_well = 20000\nread_noise = 6\npedestal = 64\n'
        '[projector]\nfolder = "shown"\nscreen = "64x48"\n[capture]\ngrid = "24x20"\n',
        encoding="ascii",
    )
    place = f"unix:{folder}/devices.sock"
    server = Server(symrig, str(right), place, "--pair", "1/1x2")
    try:
        assert "waits for the host" in server.told, server.told
        rig = folder / "devices.toml"
        rig.write_text(RIG.format(left=f'uri = "{place}"', right=f'uri = "{place}"', more=""), encoding="ascii")
        for _ in range(2):
            error = run(symrig, "capture", "--rig", str(rig), "-o", f"{folder}/none.h5", code=3).stderr
            assert error.startswith(f"symrig capture: pair 1: {place}: ") and "/dev/no-camera" in error and error.count("\n") == 1, error
        assert server.end() == 0
    finally:
        server.process.kill()


def main():
    symrig = sys.argv[1]
    try:
        import h5py  # noqa: F401, PLC0415
    except ImportError:
        sys.exit(77)
    with tempfile.TemporaryDirectory(prefix="symrig-") as name:
        folder = pathlib.Path(name)
        refuses(symrig, folder)
        serves_devices(symrig, folder)
        captured_as_one_rig(symrig, folder)
        print("trouble after a lost pair:", goes_on_after_a_lost_pair(symrig, folder))
        resumes(symrig, folder)


if __name__ == "__main__":
    main()
