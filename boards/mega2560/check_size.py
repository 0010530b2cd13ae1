#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Compares the image's sizes with [resources] of board.toml, and checks that it never uses the heap.

usage: boards/mega2560/check_size.py ELF [NM]
"""

import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "common"))
import image_size  # noqa: E402

RAM = 0x800200  # where avr-ld places the RAM of the ATmega2560
HEAP = re.compile(r"^(malloc|calloc|realloc|free|_Zn[wa].*|_Zd[la].*)$")


def main(arguments):
    if not 1 <= len(arguments) <= 2:
        sys.exit(__doc__)
    found = image_size.symbols(*(arguments + ["avr-nm"])[:2])
    # Flash: code, then the start values of variables.
    sizes = {"flash": found["__data_load_end"], "ram": found["_end"] - RAM}
    return image_size.check(HERE, found, sizes, HEAP)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
