#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Makes the files that board.toml describes.

usage: boards/pico/generate.py header FILE     the pin header of the firmware
       boards/pico/generate.py record FILE     the capability record (JSON) of the manifest
       boards/pico/generate.py docs [--fix]    checks (or renews) the tables between the markers of docs/board-pico.md
"""

import json
import pathlib
import statistics
import sys
import tomllib

HERE = pathlib.Path(__file__).resolve().parent
PAGE = HERE.parent.parent / "docs" / "board-pico.md"
WAITS = {"rising": 1, "falling": 2, "both": 4}


def load():
    with open(HERE / "board.toml", "rb") as file:
        board = tomllib.load(file)
    check(board)
    return board


def check(board):
    """Checks what the firmware assumes."""
    lines = board["line"]
    outputs = [line for line in lines if line.get("output")]
    stamped = [i for i, line in enumerate(lines) if line.get("stamp") == "pio"]
    pins = [line["gpio"] for line in lines] + list(board["pins"].values())
    rules = {
        "outputs come first, on GPIO 0, 1, 2, ...": [line["gpio"] for line in outputs] == list(range(len(outputs)))
        and lines[: len(outputs)] == outputs,
        "a pin has one use": len(set(pins)) == len(pins),
        "pins that PIO stamps are one after another": stamped == list(range(stamped[0], stamped[0] + len(stamped))),
        "three pins can be stamped by PIO": len(stamped) == 3,
        "waits and trips are for inputs": not any(line.get("waits") or line.get("trips") for line in outputs),
        "waits need PIO stamps": all(line.get("stamp") == "pio" for line in lines if line.get("waits")),
        "trips need an interrupt": all(line.get("stamp") == "irq" for line in lines if line.get("trips")),
        "inputs are on GPIO 16 to 23": all(16 <= line["gpio"] <= 23 for line in lines if not line.get("output")),
    }
    broken = [rule for rule, kept in rules.items() if not kept]
    if broken:
        sys.exit("generate.py: board.toml breaks the rule: " + "; ".join(broken))


def waits(line):
    return sum(WAITS[edge] for edge in line.get("waits", []))


def stamp_ticks(board, line):
    return board["timing"]["stamp_ticks" if line.get("stamp") == "pio" else "irq_stamp_ticks"]


def text(value):
    return json.dumps(str(value))


def header(board):
    lines, timing, calibration = board["line"], board["timing"], board["calibration"]
    outputs = sum(1 for line in lines if line.get("output"))
    stamped = [i for i, line in enumerate(lines) if line.get("stamp") == "pio"]
    number = {
        "kOutputs": outputs,
        "kOutputMask": (1 << outputs) - 1,
        "kLines": len(lines),
        "kFirstStampedLine": stamped[0],
        "kStampedLines": len(stamped),
        "kAlivePin": board["pins"]["alive"],
        "kLedPin": board["pins"]["led"],
        "kVbusPin": board["pins"]["vbus"],
        "kDmaEngineData": board["dma"]["engine_data"],
        "kDmaEngineControl": board["dma"]["engine_control"],
        "kDmaStampers": board["dma"]["stampers"],
        "kTickHz": timing["tick_hz"],
        "kMinDwell": timing["min_dwell"],
        "kMaxDwell": timing["max_dwell"],
        "kWaitLatency": timing["wait_latency"],
        "kWaitBlind": timing["wait_blind"],
        "kQueueSegments": timing["queue_segments"],
        "kRefillTicks": timing["refill_ticks"],
        "kPollTicks": timing["poll_ticks"],
        "kLaunchLatency": calibration["launch_latency"],
        "kEnableLatency": calibration["enable_latency"],
        "kStampOffset": calibration["stamp_offset"],
        "kProgramRecords": board["resources"]["program_records"],
        "kEvents": board["resources"]["events"],
        "kFlashBytes": board["board"]["flash_bytes"],
        "kSettingsSectors": board["board"]["settings_sectors"],
        "kUsbVendor": board["usb"]["vendor"],
        "kUsbProduct": board["usb"]["product"],
    }
    named = {line["gpio"]: line["name"] for line in lines} | {pin: name for name, pin in board["pins"].items()}
    number["kPinMask"] = sum(1 << pin for pin in named)
    string = {
        "kBoardName": board["board"]["name"],
        "kUsbManufacturer": board["usb"]["manufacturer"],
        "kUsbProductName": board["usb"]["product_name"],
        "kUsbInterface": board["usb"]["interface"],
        "kPinNames": "|".join(named[pin] for pin in sorted(named)),
    }
    table = ",\n".join(
        f'    {{{text(line["name"])}, "GPIO{line["gpio"]}", {str(line.get("output", False)).lower()}, {waits(line)}, '
        f'{str(line.get("trips", False)).lower()}, {stamp_ticks(board, line)}}}'
        for line in lines
    )
    parts = [
        "// SPDX-License-Identifier: Apache-2.0",
        "// Made by generate.py from board.toml.",
        "#pragma once",
        "",
        '#include "symrig/hal/board.hpp"',
        "",
        "namespace symrig::pico {",
        "",
        *(f"constexpr uint32_t {name} = {value}U;" for name, value in number.items()),
        *(f"constexpr char {name}[] = {text(value)};" for name, value in string.items()),
        "",
        "constexpr uint8_t kLinePins[kLines] = {" + ", ".join(str(line["gpio"]) for line in lines) + "};",
        "constexpr uint8_t kStampedPins[kStampedLines] = {" + ", ".join(str(lines[i]["gpio"]) for i in stamped) + "};",
        "constexpr hal::Line kLineTable[kLines] = {",
        table + "};",
        "",
        "}  // namespace symrig::pico",
    ]
    return "\n".join(parts) + "\n"


def record(board):
    timing = board["timing"]
    lines = [
        {
            "line": i,
            "name": line["name"],
            "pin": f'GPIO{line["gpio"]}',
            "output": line.get("output", False),
            "waits": line.get("waits", []),
            "trips": line.get("trips", False),
            "stamp_ticks": stamp_ticks(board, line),
        }
        for i, line in enumerate(board["line"])
    ]
    keys = ("tick_hz", "min_dwell", "max_dwell", "wait_latency", "queue_segments", "refill_ticks", "poll_ticks")
    capabilities = {key: timing[key] for key in keys}
    capabilities["program_bytes"] = 8 * board["resources"]["program_records"]
    return json.dumps({"board": board["board"]["name"], "capabilities": capabilities, "lines": lines}, indent=2) + "\n"


def tables(board):
    """Name of the marker -> Markdown."""
    ns = 1e9 / board["timing"]["tick_hz"]
    pins = []
    for output in (True, False):
        lines = [(i, line) for i, line in enumerate(board["line"]) if bool(line.get("output")) == output]
        stamps = {i: f'{"PIO" if line.get("stamp") == "pio" else "interrupt"}, {stamp_ticks(board, line) * ns:.0f} ns' for i, line in lines}
        usual_stamp = statistics.mode(stamps.values())
        usual_boot = statistics.mode(line["boot"] for _, line in lines)
        head = "Outputs" if output else "Inputs"
        pins += [f"**{head}.** Stamps: by {usual_stamp}. While booting: {usual_boot}. Exceptions are in brackets.", ""]
        for i, line in lines:
            more = [stamps[i]] if stamps[i] != usual_stamp else []
            more += [f'waits: {", ".join(line["waits"])}'] if line.get("waits") else []
            more += ["trips"] if line.get("trips") else []
            more += [line["boot"]] if line["boot"] != usual_boot else []
            pins.append(f'- {i} `{line["name"]}`, GPIO{line["gpio"]}: {line["use"]}' + (f' ({"; ".join(more)})' if more else ""))
        pins.append("")
    pins += ["Pins that are not lines:", ""]
    for name, use in (("alive", "output, a square wave while the firmware is healthy"), ("led", "output, the state of the board")):
        pins.append(f'- `{name}`, GPIO{board["pins"][name]}: {use}')
    pins.append(f'- `vbus`, GPIO{board["pins"]["vbus"]}: input, the USB cable\'s 5 V on the board')
    timing, resources = board["timing"], board["resources"]
    rows = [
        ("one tick", f"{ns:.0f} ns"),
        ("shortest word", f'{timing["min_dwell"]} ticks, {timing["min_dwell"] * ns:.0f} ns'),
        ("longest word", f'{timing["max_dwell"]} ticks, {timing["max_dwell"] * ns / 1e9:.1f} s'),
        ("from an awaited edge to the next word", f'{timing["wait_latency"]} ticks, {timing["wait_latency"] * ns:.0f} ns'),
        ("program", f'{resources["program_records"]:,} records'),
        ("engine's queue", f'{timing["queue_segments"]:,} words'),
        ("refilling one word", f'at most {timing["refill_ticks"]} ticks, {timing["refill_ticks"] * ns / 1e3:.1f} µs'),
        ("round of the main loop", f'at most {timing["poll_ticks"]} ticks, {timing["poll_ticks"] * ns / 1e3:.0f} µs'),
    ]
    numbers = [f"- {name}: {value}" for name, value in rows]
    return {"pins": "\n".join(pins), "numbers": "\n".join(numbers)}


def renew(page, board):
    for name, table in tables(board).items():
        begin, end = f"<!-- generated: {name} -->", "<!-- end -->"
        if begin not in page:
            sys.exit(f"generate.py: {PAGE.name} has no marker '{begin}'")
        head, rest = page.split(begin, 1)
        _, tail = rest.split(end, 1)
        page = f"{head}{begin}\n\n{table}\n\n{end}{tail}"
    return page


def docs(board, fix):
    before = PAGE.read_text(encoding="utf-8")
    after = renew(before, board)
    if before == after:
        return 0
    if fix:
        PAGE.write_text(after, encoding="utf-8")
        return 0
    print(f"docs/{PAGE.name}: its tables are not those of boards/pico/board.toml; run boards/pico/generate.py docs --fix")
    return 1


def write(path, content):
    """Leaves a file alone that is right already, so that nothing is built again for it."""
    path = pathlib.Path(path)
    if not path.exists() or path.read_text(encoding="utf-8") != content:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content, encoding="utf-8")


def main(arguments):
    board = load()
    if len(arguments) == 2 and arguments[0] in ("header", "record"):
        write(arguments[1], (header if arguments[0] == "header" else record)(board))
        return 0
    if arguments in (["docs"], ["docs", "--fix"]):
        return docs(board, len(arguments) == 2)
    sys.exit(__doc__)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
