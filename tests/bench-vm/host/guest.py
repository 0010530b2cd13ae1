# SPDX-License-Identifier: Apache-2.0
"""One guest: the QEMU command line, the control folder that it shares with the runner, and the wait for its end."""

import contextlib
import os
import pathlib
import shlex
import signal
import subprocess
import sys
import tempfile
import time

from host.assets import BENCH
from host.outside import SLOW_KERNEL_ARGUMENTS, Screendumps, serve_pico, slow_environment

POLL = 0.02  # seconds between two checks of the guest's files
# The guest gets these variables of the caller's environment, and those that begin with one of PREFIXES.
PREFIXES = ("SYMRIG_", "BENCH_", "ASAN_", "LSAN_", "UBSAN_", "TSAN_", "GTEST_", "RC_", "LC_")
NAMES = ("PATH", "LANG", "TERM")
# no_timer_check: on a busy computer the kernel's first ticks come late, and it would treat its timer as broken.
KERNEL_ARGUMENTS = (
    "console=ttyS0 quiet loglevel=4 panic=-1 mitigations=off nokaslr random.trust_cpu=on no_timer_check"
    " cryptomgr.notests apparmor=0 audit=0 rcupdate.rcu_expedited=1 init_on_alloc=0".split()
)


class GuestFailure(Exception):
    """The guest ended, or was ended, without an exit status of the command."""


def start_script(asked, assets, pico_port):
    """The script of the guest's first process: settings, then guest/start."""
    kept = {name: text for name, text in os.environ.items() if name in NAMES or name.startswith(PREFIXES)}
    settings = kept | {
        "HOME": "/root",
        "BENCH_HOME": str(BENCH),
        "BENCH_TESTCAM": str(assets.testcam),
        "BENCH_DEVICES": " ".join(asked.devices),
        "BENCH_USER": asked.user,
        "BENCH_FOLDER": os.getcwd(),
        "BENCH_LANE": asked.lane,
        "BENCH_PICO_PORT": str(pico_port or ""),
    }
    lines = [f"export {name}={shlex.quote(text)}" for name, text in settings.items() if name.isidentifier()]
    return "\n".join([*lines, f"exec /bin/bash {shlex.quote(str(BENCH / 'guest/start'))}", ""])


def share(tag, path, options):
    """Shares a folder of this computer with the guest. multidevs: the tree may span file systems whose inodes collide."""
    return [
        "-fsdev", f"local,id={tag},path={str(path).replace(',', ',,')},security_model=none{options}",
        "-device", f"virtio-9p-pci,fsdev={tag},mount_tag={tag}",
    ]  # fmt: skip


def qemu_command(asked, assets, control, out):
    """Always one processor: with two, the guest's kernel lost edges, and virtual time hung."""
    accelerator = "tcg,thread=multi,tb-size=512" if asked.lane == "a" else "tcg,thread=single,tb-size=512"
    command = [
        "qemu-system-x86_64", "-M", "q35", "-accel", accelerator, "-cpu", "max", "-smp", "1", "-m", "1024",
        "-nodefaults", "-no-user-config", "-no-reboot", "-display", "none",
        "-kernel", str(assets.kernel), "-initrd", str(assets.initrd),
        "-append", " ".join([*KERNEL_ARGUMENTS, f"BENCH_LANE={asked.lane}", *(SLOW_KERNEL_ARGUMENTS if asked.slow > 1 else ())]),
        "-serial", f"file:{control / 'console.log'}",
        *share("host", "/", ",readonly=on,multidevs=remap"),
        *share("layer", assets.layer, ",readonly=on,multidevs=remap"),
        *share("control", control, ",multidevs=remap"),
        *share("out", out, ",multidevs=remap"),
    ]  # fmt: skip
    if asked.lane == "b":
        command += ["-icount", "shift=0,sleep=off"]
    if asked.vga:
        width, height = asked.vga
        command += ["-device", f"VGA,id=vga,vgamem_mb=64,xres={width},yres={height}"]
        command += ["-qmp", f"unix:{control / 'qmp'},server=on,wait=off"]
    if asked.pico:
        command += ["-netdev", "user,id=net", "-device", "virtio-net-pci,netdev=net,romfile="]
    return command


class Log:
    """Copies the command's output to standard output while it runs."""

    def __init__(self, path):
        path.touch()
        self._file = path.open("rb")

    def copy(self):
        text = self._file.read()
        if text:
            sys.stdout.buffer.write(text)
            sys.stdout.buffer.flush()


def tail(path, lines):
    """The end of a text file. After a kernel panic: everything from the panic on."""
    try:
        text = path.read_text(errors="replace")
    except OSError:
        return ""
    panic = text.find("Kernel panic")
    return text[panic:].strip() if panic >= 0 else "\n".join(text.splitlines()[-lines:])


def wait(process, asked, log, screendumps):
    """Waits until the guest ends or times out. True if it ended by itself."""
    deadline = time.monotonic() + asked.timeout
    while process.poll() is None:
        log.copy()
        screendumps.answer()
        if time.monotonic() > deadline:
            return False
        time.sleep(POLL)
    log.copy()
    return True


def status(control, ended, asked, started):
    """The command's exit status, or the reason why there is none."""
    if os.environ.get("BENCH_TIMES") and (control / "ready").exists():
        ready = (control / "ready").stat().st_mtime - started
        print(f"bench-vm: ready after {ready:.1f} s, ended after {time.time() - started:.1f} s", file=sys.stderr)
    if (control / "status").exists():
        return int((control / "status").read_text())
    if (control / "ready").exists():
        reason = "ended before the command did" if ended else f"had not finished the command in {asked.timeout:g} s (--timeout)"
    else:
        reason = "ended" if ended else f"was not ready in {asked.timeout:g} s (--timeout)"
        reason = f"{reason} while setting up:\n{tail(control / 'setup.log', 40)}\n"
    raise GuestFailure(f"the guest {reason}; the end of its console:\n{tail(control / 'console.log', 40)}")


def boot(asked, assets, folder, pico_port):
    """Runs one guest, with its control folder in `folder`. Returns the command's exit status."""
    control = folder / "control"
    control.mkdir(mode=0o755)
    out = asked.out or folder / "out"
    out.mkdir(exist_ok=True)
    if asked.user:
        out.chmod(0o777)
    (control / "start").write_text(start_script(asked, assets, pico_port))
    (control / "command").write_text("exec " + shlex.join(asked.command) + "\n")
    log = Log(control / "log")
    started = time.time()
    with (control / "qemu.log").open("wb") as errors, subprocess.Popen(
        qemu_command(asked, assets, control, out), stdin=subprocess.DEVNULL, stdout=errors, stderr=errors,
        env=slow_environment(asked.slow),
    ) as process:
        try:
            ended = wait(process, asked, log, Screendumps(out, control / "qmp", asked.vga))
        finally:
            process.kill()
    if process.returncode not in (0, -signal.SIGKILL):
        raise GuestFailure(f"QEMU ended with status {process.returncode}: {tail(control / 'qemu.log', 5)}")
    return status(control, ended, asked, started)


def run(asked, assets):
    """Boots a guest, runs asked.command in it and returns its exit status. Raises GuestFailure."""
    with contextlib.ExitStack() as stack:
        folder = pathlib.Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="bench-vm-")))
        port = stack.enter_context(serve_pico(asked.pico, asked.slow)) if asked.pico else None
        return boot(asked, assets, folder, port)
