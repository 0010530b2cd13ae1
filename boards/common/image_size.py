# SPDX-License-Identifier: Apache-2.0
"""Compares a firmware image's sizes with [resources] of its board.toml, and checks that it never uses the heap.

Each board's check_size.py says where its linker puts things, and which symbols would mean a heap."""

import subprocess
import tomllib


def symbols(elf, nm):
    """Name -> address of all linked symbols."""
    listed = subprocess.run([nm, str(elf)], capture_output=True, check=True, text=True).stdout
    return {name: int(address, 16) for address, _, name in (line.split(maxsplit=2) for line in listed.splitlines() if line[0] != " ")}


def check(folder, found, sizes, heap):
    """Exit status: 0, or 1 after a line for each problem.

    folder: the board's. found: its symbols. sizes: bytes of "flash" and "ram". heap: pattern of names that must not be linked."""
    limits = tomllib.loads((folder / "board.toml").read_text(encoding="utf-8"))["resources"]
    problems = [f"{name} is linked: something would use the heap" for name in sorted(found) if heap.match(name)]
    for kind, title in (("flash", "flash"), ("ram", "RAM")):
        if sizes[kind] > limits[f"{kind}_limit"]:
            problems.append(f"{sizes[kind]} bytes of {title} are more than {limits[f'{kind}_limit']}")
    for problem in problems:
        print(f"check_size: {problem}")
    heap_used = "a heap" if any("heap" in problem for problem in problems) else "no heap"
    print(f"check_size: flash {sizes['flash']} of {limits['flash_limit']} bytes, RAM {sizes['ram']} of {limits['ram_limit']}, {heap_used}")
    return 1 if problems else 0
