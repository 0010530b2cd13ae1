#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Compares the image's sizes with [resources] of board.toml, and checks that it never uses the heap.

usage: boards/pico/check_size.py ELF [NM]
"""

import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "common"))
import image_size  # noqa: E402

FLASH = 0x10000000
RAM = 0x20000000
HEAP = re.compile(r"^(_?(malloc|calloc|realloc|free|sbrk)(_r)?|_Zn[wa].*|_Zd[la].*|__cxa_(?!pure_virtual$).*|_?exit|abort)$")


def main(arguments):
    if not 1 <= len(arguments) <= 2:
        sys.exit(__doc__)
    found = image_size.symbols(*(arguments + ["arm-none-eabi-nm"])[:2])
    stack = found["__stack_top"] - found["__stack_bottom"]
    sizes = {"flash": found["__flash_end"] - FLASH, "ram": found["__ram_end"] - RAM + stack}
    return image_size.check(HERE, found, sizes, HEAP)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
