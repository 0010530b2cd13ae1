#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Compares a firmware image's sizes with [resources] of its board.toml, and checks that it never uses the heap.

usage: boards/common/check_size.py BOARD ELF [NM]     BOARD: pico or mega2560
"""

import pathlib
import re
import subprocess
import sys
import tomllib

BOARDS = pathlib.Path(__file__).resolve().parent.parent
PICO_FLASH, PICO_RAM = 0x10000000, 0x20000000
MEGA2560_RAM = 0x800200  # where avr-ld places the RAM
# Names that must not be linked.
HEAP = {
    "pico": re.compile(r"^(_?(malloc|calloc|realloc|free|sbrk)(_r)?|_Zn[wa].*|_Zd[la].*|__cxa_(?!pure_virtual$).*|_?exit|abort)$"),
    "mega2560": re.compile(r"^(malloc|calloc|realloc|free|_Zn[wa].*|_Zd[la].*)$"),
}
NM = {"pico": "arm-none-eabi-nm", "mega2560": "avr-nm"}


def symbols(elf, nm):
    """Name -> address of all linked symbols."""
    listed = subprocess.run([nm, str(elf)], capture_output=True, check=True, text=True).stdout
    return {name: int(address, 16) for address, _, name in (line.split(maxsplit=2) for line in listed.splitlines() if line[0] != " ")}


def sizes_of(board, found):
    """Bytes of "flash" and "ram", by the symbols that the board's linker sets."""
    if board == "mega2560":
        return {"flash": found["__data_load_end"], "ram": found["_end"] - MEGA2560_RAM}  # flash: code, then the start values of variables
    stack = found["__stack_top"] - found["__stack_bottom"]
    return {"flash": found["__flash_end"] - PICO_FLASH, "ram": found["__ram_end"] - PICO_RAM + stack}


def check(board, found, sizes):
    """Exit status: 0, or 1 after a line for each problem. found: the image's symbols."""
    limits = tomllib.loads((BOARDS / board / "board.toml").read_text(encoding="utf-8"))["resources"]
    problems = [f"{name} is linked: something would use the heap" for name in sorted(found) if HEAP[board].match(name)]
    for kind, title in (("flash", "flash"), ("ram", "RAM")):
        if sizes[kind] > limits[f"{kind}_limit"]:
            problems.append(f"{sizes[kind]} bytes of {title} are more than {limits[f'{kind}_limit']}")
    for problem in problems:
        print(f"check_size: {problem}")
    heap_used = "a heap" if any("heap" in problem for problem in problems) else "no heap"
    print(f"check_size: flash {sizes['flash']} of {limits['flash_limit']} bytes, RAM {sizes['ram']} of {limits['ram_limit']}, {heap_used}")
    return 1 if problems else 0


def main(arguments):
    if not 2 <= len(arguments) <= 3 or arguments[0] not in HEAP:
        sys.exit(__doc__)
    board, elf = arguments[:2]
    found = symbols(elf, arguments[2] if len(arguments) > 2 else NM[board])
    return check(board, found, sizes_of(board, found))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
