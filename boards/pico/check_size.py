#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Compares the image's sizes with [resources] of board.toml, and checks that it never uses the heap.

usage: boards/pico/check_size.py ELF [NM]
"""

import pathlib
import re
import subprocess
import sys
import tomllib

HERE = pathlib.Path(__file__).resolve().parent
FLASH = 0x10000000
RAM = 0x20000000
HEAP = re.compile(r"^(_?(malloc|calloc|realloc|free|sbrk)(_r)?|_Zn[wa].*|_Zd[la].*|__cxa_(?!pure_virtual$).*|_?exit|abort)$")


def symbols(elf, nm):
    """Name -> address of all linked symbols."""
    listed = subprocess.run([nm, str(elf)], capture_output=True, check=True, text=True).stdout
    return {name: int(address, 16) for address, _, name in (line.split(maxsplit=2) for line in listed.splitlines() if line[0] != " ")}


def main(arguments):
    if not 1 <= len(arguments) <= 2:
        sys.exit(__doc__)
    with open(HERE / "board.toml", "rb") as file:
        limits = tomllib.load(file)["resources"]
    found = symbols(*(arguments + ["arm-none-eabi-nm"])[:2])
    flash = found["__flash_end"] - FLASH
    stack = found["__stack_top"] - found["__stack_bottom"]
    ram = found["__ram_end"] - RAM + stack
    problems = [f"{name} is linked: something would use the heap" for name in sorted(found) if HEAP.match(name)]
    if flash > limits["flash_limit"]:
        problems.append(f"{flash} bytes of flash are more than {limits['flash_limit']}")
    if ram > limits["ram_limit"]:
        problems.append(f"{ram} bytes of RAM are more than {limits['ram_limit']}")
    for problem in problems:
        print(f"check_size: {problem}")
    print(f"check_size: flash {flash} of {limits['flash_limit']} bytes, RAM {ram} of {limits['ram_limit']}, no heap")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
