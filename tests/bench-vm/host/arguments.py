# SPDX-License-Identifier: Apache-2.0
"""The runner's command line."""

import argparse
import dataclasses
import pathlib
import pwd
import re
import sys

DEVICES = ("gpio", "usb", "camera", "vivid", "vkms", "vga", "usbip")
VGA = re.compile(r"vga=(\d{3,4})x(\d{3,4})$")
HELP = """
Devices: gpio (gpio-sim), usb (gadget on a virtual bus), camera (the test camera), vivid, vkms and vga=WxH (displays), usbip.
They are set up in this order; $BENCH_... variables tell the command where they are (README.md).
Lane a: a guest in real time. Lane b: virtual time, one instruction is one nanosecond, idle time costs nothing.

The guest's root is this machine's, read-only with a memory of its own above: what COMMAND writes is gone afterwards, except
what it writes to $BENCH_OUT. Exit status: COMMAND's; 2 bad arguments; 77 no bench on this machine; 125 the guest itself failed.
"""


@dataclasses.dataclass(frozen=True)
class Asked:
    """What the command line asks for."""

    lane: str
    timeout: float
    devices: tuple  # names of DEVICES, in their order
    vga: tuple | None  # (width, height)
    user: str
    out: pathlib.Path | None
    command: list


class OneLineParser(argparse.ArgumentParser):
    """A wrong argument is answered with one line."""

    def error(self, message):
        print(f"{self.prog}: {message}; see {self.prog} --help", file=sys.stderr)
        sys.exit(2)


def parse_devices(text, fail):
    """(names in the order of setting up, size of the vga display or None)."""
    names, vga = set(), None
    for word in filter(None, text.split(",")):
        match = VGA.match(word)
        if match:
            vga = (int(match[1]), int(match[2]))
        elif word not in DEVICES or word == "vga":
            fail(f"unknown device '{word}' in --with; there are {', '.join(DEVICES[:-2])}, vga=WxH, usbip")
        names.add("vga" if match else word)
    return tuple(name for name in DEVICES if name in names), vga


def check_user(name, fail):
    if name:
        try:
            pwd.getpwnam(name)
        except KeyError:
            fail(f"--user: this machine has no user '{name}'")
    return name


def check_out(folder, fail):
    if folder:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            fail(f"--out: cannot make the folder {folder}: {error.strerror}")
    return folder.resolve() if folder else None


def parse(arguments, description):
    """An Asked; ends the program with status 2 and one line if the arguments are wrong."""
    parser = OneLineParser(
        prog="tests/bench-vm/run", description=description, epilog=HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False,
        usage="%(prog)s [--lane a|b] [--timeout S] [--with DEVICES] [--user NAME] [--out DIR] -- COMMAND...",
    )  # fmt: skip
    parser.add_argument("--lane", choices="ab", default="a", help="real time (a, the default) or virtual time (b)")
    parser.add_argument("--timeout", type=float, default=300, metavar="S", help="seconds of wall time for all of it (300)")
    parser.add_argument("--with", dest="devices", default="", metavar="DEVICES", help="devices, separated by commas")
    parser.add_argument("--user", default="", metavar="NAME", help="run COMMAND as this user instead of root")
    parser.add_argument("--out", type=pathlib.Path, metavar="DIR", help="where the files of $BENCH_OUT lie afterwards")
    parser.add_argument("command", nargs="*", metavar="COMMAND")
    split = arguments.index("--") if "--" in arguments else len(arguments)
    asked = parser.parse_args(arguments[:split])
    command = asked.command + arguments[split + 1 :]
    if not command:
        parser.error("no COMMAND after --")
    if not asked.timeout > 0:
        parser.error("--timeout must be positive")
    devices, vga = parse_devices(asked.devices, parser.error)
    user, out = check_user(asked.user, parser.error), check_out(asked.out, parser.error)
    return Asked(asked.lane, asked.timeout, devices, vga, user, out, command)
