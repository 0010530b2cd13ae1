# SPDX-License-Identifier: Apache-2.0
"""The runner's command line."""

import argparse
import dataclasses
import pathlib
import pwd
import re
import sys

from host.assets import cannot

DEVICES = ("gpio", "usb", "camera", "vivid", "vkms", "vkms_b", "vga", "usbip", "pico", "hostwait")
WITH_VALUE = ("vga", "pico")
VGA = re.compile(r"(\d{3,4})x(\d{3,4})$")
HELP = """
Devices: gpio (gpio-sim), usb (gadget on a virtual bus), camera (the test camera), vivid, vkms, vkms_b and vga=WxH (displays),
usbip (a USB host for devices over TCP), pico=IMAGE.uf2 (an emulated Pico on it, lane a only). hostwait is no device: waiting for
this computer's files is no idle time (lane b only).
They are set up in this order. $BENCH_... variables give the command their names and paths (README.md).
Lane a: a guest in real time, or in slow motion for a slow computer. Lane b: virtual time; one instruction takes one nanosecond, and idle time passes at once.

The guest's root file system is this computer's, read-only, with a layer in memory above it. What COMMAND writes is lost at the
end, except files in $BENCH_OUT. Exit status: COMMAND's; 2 bad arguments; 77 no bench on this computer; 125 the guest failed.
"""


@dataclasses.dataclass(frozen=True)
class Asked:
    """The parsed command line."""

    lane: str
    slow: int  # how many times slower than real time the guest's clock runs
    timeout: float
    devices: tuple  # names of DEVICES, in their order
    vga: tuple | None  # (width, height)
    pico: pathlib.Path | None  # the emulated Pico's image
    user: str
    out: pathlib.Path | None
    command: list


class OneLineParser(argparse.ArgumentParser):
    """Reports a wrong argument in one line."""

    def error(self, message):
        print(f"{self.prog}: {message}; see {self.prog} --help", file=sys.stderr)
        sys.exit(2)


def parse_size(text, fail):
    match = VGA.match(text)
    if not match:
        fail(f"--with vga={text}: the size must be WIDTHxHEIGHT, as in vga=912x1140")
    return (int(match[1]), int(match[2]))


def parse_image(text):
    path = pathlib.Path(text)
    if not path.is_file():
        cannot(f"--with pico={text}: there is no such file; tools/firmware builds build/pico/symrig-pico.uf2")
    return path.resolve()


def parse_devices(text, fail):
    """{name: value or None}, in the order of setting up."""
    found = {}
    for word in filter(None, text.split(",")):
        name, _, value = word.partition("=")
        if name not in DEVICES or bool(value) != (name in WITH_VALUE):
            fail(f"unknown device '{word}' in --with; choose from {', '.join(DEVICES[:6])}, vga=WxH, usbip, pico=IMAGE, hostwait")
        found[name] = value or None
    return {name: found[name] for name in DEVICES if name in found}


def check_user(name, fail):
    if name:
        try:
            pwd.getpwnam(name)
        except KeyError:
            fail(f"--user: this computer has no user '{name}'")
    return name


def check_out(folder, fail):
    if folder:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            fail(f"--out: cannot make the folder {folder}: {error.strerror}")
    return folder.resolve() if folder else None


def parse(arguments, description):
    """Returns an Asked. Wrong arguments end the program with status 2 and one line."""
    parser = OneLineParser(
        prog="tests/bench-vm/run", description=description, epilog=HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False,
        usage="%(prog)s [--lane a|b] [--slow K] [--timeout S] [--with DEVICES] [--user NAME] [--out DIR] -- COMMAND...",
    )  # fmt: skip
    parser.add_argument("--lane", choices="ab", default="a", help="real time (a, the default) or virtual time (b)")
    parser.add_argument("--slow", type=int, default=1, metavar="K", help="lane a: a second in the guest takes K seconds (1)")
    parser.add_argument("--timeout", type=float, default=300, metavar="S", help="limit for everything, in seconds of wall time (300)")
    parser.add_argument("--with", dest="devices", default="", metavar="DEVICES", help="devices, separated by commas")
    parser.add_argument("--user", default="", metavar="NAME", help="run COMMAND as this user instead of root")
    parser.add_argument("--out", type=pathlib.Path, metavar="DIR", help="folder that gets the files of $BENCH_OUT")
    parser.add_argument("command", nargs="*", metavar="COMMAND")
    split = arguments.index("--") if "--" in arguments else len(arguments)
    asked = parser.parse_args(arguments[:split])
    command = asked.command + arguments[split + 1 :]
    if not command:
        parser.error("no COMMAND after --")
    if not asked.timeout > 0:
        parser.error("--timeout must be positive")
    if not 1 <= asked.slow <= 100 or (asked.slow > 1 and asked.lane == "b"):
        parser.error("--slow must be from 1 to 100, and 1 in lane b, where the clock counts instructions")
    devices = parse_devices(asked.devices, parser.error)
    vga = parse_size(devices["vga"], parser.error) if "vga" in devices else None
    pico = parse_image(devices["pico"]) if "pico" in devices else None
    if pico and asked.lane == "b":
        parser.error("--with pico: the emulation outside the guest cannot keep its virtual time; use lane a")
    if "hostwait" in devices and asked.lane == "a":
        parser.error("--with hostwait: time is this computer's in lane a; use lane b")
    user, out = check_user(asked.user, parser.error), check_out(asked.out, parser.error)
    return Asked(asked.lane, asked.slow, asked.timeout, tuple(devices), vga, pico, user, out, command)
