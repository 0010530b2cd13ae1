#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Checks in the disassembly that nothing but start-up runs in flash, so that no interrupt and no round of the main loop
can wait for a flash access.

usage: boards/pico/check_flash.py ELF [OBJDUMP]

Fails in these cases:
- A function lies in flash and is not one of start-up (section .startup).
- A function in flash calls or refers to anything in RAM, apart from the jump that leaves flash.
- Code in RAM branches to flash.
- Code in RAM holds the address of flash code or of the settings among its constants, and is not listed in READERS below.
- A word of the data that start-up copies to RAM is the address of flash code (a vector, a virtual function, a pointer).
- An interrupt's vector is not a function in RAM.
Any path from a handler into flash needs one of these.
"""

import re
import subprocess
import sys

FLASH = range(0x10000000, 0x14000000)
SETTINGS = range(0x101FE000, 0x10200000)
RAM = range(0x20000000, 0x20042000)
LEAVES_FLASH = ("reset_handler", "begin_in_ram")
# Functions that read flash as data: the settings, and boot2 for its copy. None runs in an interrupt (HANDLERS).
READERS = re.compile(r"PicoSettings|4pico.*(5sound|6newest|10copy_boot2|6memory|14read_unique_id)")
HANDLERS = re.compile(r"(_handler$|crash)")
SYMBOL = re.compile(r"^([0-9a-f]{8}) <(.+)>:$")
TARGET = re.compile(r"\b([0-9a-f]{8}) <")
# Offset in the vector table of the reset vector, which only the boot ROM reads.
RESET_VECTOR = 4


def run(*command):
    return subprocess.run(command, capture_output=True, check=True, text=True).stdout


class Function:
    def __init__(self, address, name):
        self.address, self.name = address, name
        self.branches, self.words = [], []

    @property
    def in_flash(self):
        return self.address in FLASH


def disassembled(elf, objdump):
    """All functions, with the addresses that they branch to and the constants among their instructions."""
    found = []
    for line in run(objdump, "-d", "--no-show-raw-insn", "-j", ".boot2", "-j", ".startup", "-j", ".data", elf).splitlines():
        if head := SYMBOL.match(line):
            found.append(Function(int(head[1], 16), head[2]))
        elif found and (word := re.match(r"^[0-9a-f]{8}:\s+\.word\s+0x([0-9a-f]{8})", line)):
            found[-1].words.append(int(word[1], 16))
        elif found and re.match(r"^[0-9a-f]{8}:\s+(b|bl|blx|b[a-z]{2})(\.n)?\s", line):
            found[-1].branches += [int(target, 16) for target in TARGET.findall(line)]
    return found


def section_words(elf, objdump, name):
    """Address -> word of a section's content."""
    words = {}
    for line in run(objdump, "-s", "-j", name, elf).splitlines():
        if row := re.match(r"^ ([0-9a-f]{8}) ((?:[0-9a-f]{8} ?){1,4})", line):
            for index, word in enumerate(row[2].split()):
                if len(word) == 8:
                    words[int(row[1], 16) + 4 * index] = int.from_bytes(bytes.fromhex(word), "little")
    return words


def check_functions(functions, code_end, flash_code):
    problems = []
    for function in functions:
        if function.address >= code_end and not function.in_flash:
            continue  # data that is shown as if it were code
        reads = READERS.search(function.name) and not HANDLERS.search(function.name)
        for target in function.branches:
            leaves = any(name in function.name for name in LEAVES_FLASH)
            if function.in_flash and target not in FLASH and not leaves:
                problems.append(f"{function.name} runs before the copy and calls {target:#x}")
            if not function.in_flash and target in FLASH:
                problems.append(f"{function.name} branches to flash at {target:#x}")
        problems += [
            f"{function.name} holds the flash address {word:#x}"
            for word in function.words
            if (word in flash_code or word in SETTINGS) and not function.in_flash and not reads
        ]
    return problems


def check_places(symbols, data, vectors):
    problems = []
    startup = ("boot2", *LEAVES_FLASH)
    allowed = re.compile(r"(^__startup_end$|^reset_handler$|^early_crash_handler$|start_clocks|^__begin_in_ram_veneer$)")
    for name, (address, kind) in symbols.items():
        if kind in "tTwW" and address in FLASH and address >= 0x10000100 and not allowed.search(name) and name not in startup:
            problems.append(f"{name} is in flash")
    for index in range(1, 48):
        target = data[vectors + 4 * index]
        if index != 1 and target != 0 and target not in RAM:
            problems.append(f"vector {index} is {target:#x}, which is not in RAM")
    return problems


def check_data(data, code_end, vectors, flash_code):
    return [
        f"the word at {address:#x} is the flash address {word:#x}"
        for address, word in data.items()
        if word in flash_code and address != vectors + RESET_VECTOR and address >= code_end
    ]


def main(arguments):
    if not 1 <= len(arguments) <= 2:
        sys.exit(__doc__)
    elf, objdump = (arguments + ["arm-none-eabi-objdump"])[:2]
    rows = [line.split() for line in run(objdump.replace("objdump", "nm"), elf).splitlines() if line[0] != " "]
    symbols = {name: (int(address, 16), kind) for address, kind, name in rows}
    data = section_words(elf, objdump, ".data")
    code_end, vectors = symbols["__code_end"][0], symbols["__data_start"][0]
    functions = disassembled(elf, objdump)
    flash_code = range(FLASH.start + 0x100, symbols["__startup_end"][0])
    problems = check_functions(functions, code_end, flash_code) + check_places(symbols, data, vectors)
    problems += check_data(data, code_end, vectors, flash_code)
    for problem in problems:
        print(f"check_flash: {problem}")
    ran = [each for each in functions if each.in_flash or each.address < code_end]
    print(f"check_flash: {len(ran)} functions, {sum(each.in_flash for each in ran)} of them for start-up; no other path into flash")
    return 1 if problems or len(ran) < 100 else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
