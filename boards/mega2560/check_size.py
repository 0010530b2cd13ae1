#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Compares the image's sizes with [resources] of board.toml, and checks that it never uses the heap.

usage: boards/mega2560/check_size.py ELF [NM]
"""

import pathlib
import re
import subprocess
import sys
import tomllib

HERE = pathlib.Path(__file__).resolve().parent
RAM = 0x800200  # where avr-ld places the RAM of the ATmega2560
HEAP = re.compile(r"^(malloc|calloc|realloc|free|_Zn[wa].*|_Zd[la].*)$")


def main(arguments):
    if not 1 <= len(arguments) <= 2:
        sys.exit(__doc__)
    with open(HERE / "board.toml", "rb") as file:
        limits = tomllib.load(file)["resources"]
    elf, nm = (arguments + ["avr-nm"])[:2]
    listed = subprocess.run([nm, elf], capture_output=True, check=True, text=True).stdout
    found = {name: int(address, 16) for address, _, name in (line.split(maxsplit=2) for line in listed.splitlines() if line[0] != " ")}
    flash = found["__data_load_end"]  # code, then the start values of variables
    ram = found["_end"] - RAM
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
