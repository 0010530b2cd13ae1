#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Makes the files that board.toml describes.

usage: boards/mega2560/generate.py header FILE     the pin header of the firmware
       boards/mega2560/generate.py docs [--fix]    checks (or renews) the table between the markers of docs/board-mega2560.md
"""

import json
import pathlib
import sys
import tomllib

HERE = pathlib.Path(__file__).resolve().parent
PAGE = HERE.parent.parent / "docs" / "board-mega2560.md"
BEGIN, END = "<!-- lines: begin -->\n", "<!-- lines: end -->\n"
INPUT_PORTS = ["PD0", "PD1", "PD2", "PD3", "PE4", "PE5"]  # INT0 to INT5


def load():
    with open(HERE / "board.toml", "rb") as file:
        board = tomllib.load(file)
    ports = [line["port"] for line in board["line"]]
    outputs = [line["port"] for line in board["line"] if line.get("output")]
    wanted = [f"PA{k}" for k in range(len(outputs))] + INPUT_PORTS
    if len(outputs) != 6 or ports != wanted:
        sys.exit(f"generate.py: board.toml's lines are on {ports}; src/interrupts.hpp needs {wanted}")
    return board


def header(board):
    timing, resources = board["timing"], board["resources"]
    number = {
        "kTickHz": timing["tick_hz"],
        "kMinDwell": timing["min_dwell"],
        "kMaxDwell": timing["max_dwell"],
        "kWaitLatency": timing["wait_latency"],
        "kLateness": timing["lateness"],
        "kLead": timing["lead"],
        "kQueueSegments": timing["queue_segments"],
        "kMarks": timing["queue_segments"],
        "kRefillTicks": timing["refill_ticks"],
        "kPollTicks": timing["poll_ticks"],
        "kProgramRecords": resources["program_records"],
        "kEvents": resources["events"],
    }
    lines = [
        "// Made by boards/mega2560/generate.py from board.toml.",
        "#pragma once",
        "",
        '#include "symrig/hal/board.hpp"',
        "",
        "namespace symrig::mega2560 {",
        "",
        f"constexpr char kBoardName[] = {json.dumps(board['board']['name'])};",
        *[f"constexpr uint32_t {name} = {value};" for name, value in number.items()],
        "constexpr hal::Line kLineTable[] = {",
    ]
    for line in board["line"]:
        output = line.get("output", False)
        stamp = timing["output_stamp_ticks" if output else "stamp_ticks"]
        abilities = "true, 0, false" if output else "false, hal::waits::all, true"
        lines.append(f'    {{{json.dumps(line["name"])}, {json.dumps(line["pin"])}, {abilities}, {stamp}}},')
    return "\n".join([*lines, "};", "", "}  // namespace symrig::mega2560", ""])


def table(board):
    rows = ["| line | name | direction | pin | use |", "|---|---|---|---|---|"]
    for number, line in enumerate(board["line"]):
        direction = "output" if line.get("output") else "input, waits, trips"
        rows.append(f"| {number} | `{line['name']}` | {direction} | {line['pin']} ({line['port']}) | {line['use']} |")
    return "\n".join([*rows, ""])


def docs(board, fix):
    text = PAGE.read_text(encoding="utf-8")
    head, rest = text.split(BEGIN)
    old, tail = rest.split(END)
    new = table(board)
    if old == new:
        return 0
    if not fix:
        print(f"{PAGE.name}: the table of lines is not that of board.toml: boards/mega2560/generate.py docs --fix", file=sys.stderr)
        return 1
    PAGE.write_text(head + BEGIN + new + END + tail, encoding="utf-8")
    return 0


def main():
    match sys.argv[1:]:
        case ["header", path]:
            pathlib.Path(path).write_text(header(load()), encoding="utf-8")
        case ["docs"]:
            return docs(load(), False)
        case ["docs", "--fix"]:
            return docs(load(), True)
        case _:
            print(__doc__, file=sys.stderr)
            return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
