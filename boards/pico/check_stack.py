#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Computes the greatest depth of the stack from the call graph that the compiler writes beside each object file.

usage: boards/pico/check_stack.py BUILD_FOLDER [--show]

Sums frames (-fcallgraph-info=su) along the deepest path from main(), and adds one path for each interrupt priority.
Fails if main's path is deeper than [resources].stack_limit of board.toml. Fails if the sum does not fit the memory that
link.ld gives to the stack. Fails if a frame has no fixed size, if a call's target is unknown, or if a function can call
itself. nanopb is an exception: it descends once for each level of nested messages.
"""

import collections
import pathlib
import re
import sys
import tomllib

HERE = pathlib.Path(__file__).resolve().parent
NODE = re.compile(r'node: \{ title: "([^"]+)" label: "([^"]*)"')
EDGE = re.compile(r'edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"')
FRAME = re.compile(r"(\d+) bytes \((\w+)(?:,bounded)?\)")
INDIRECT = "__indirect_call"

# Bytes for functions without a call graph: those of the C library and the compiler (at most 44 bytes in the
# disassembly), and the boot ROM's flash functions (data sheet: less than 256).
LIBRARY = 48
LEAVES = {"__aeabi_llsl": 0}  # those of them that are on the deepest path, from the disassembly
ROM = 256
# Nesting of messages in symrig.proto, which is how often nanopb's loops can be on the stack. A board decodes
# requests (Request, its body), and encodes bodies of replies (with a Fault or Crash inside) and events (Event, its body).
NESTED = {"decode": 2, "encode": 2}
EXCEPTION_FRAME = 36  # eight words, and one for alignment
CRASH = EXCEPTION_FRAME  # a crash on top of everything: its handler has a stack of its own
GUARD = 256  # of link.ld's stack

INTERRUPTS = {0: ["gpio_handler"], 1: ["pio0_handler", "timer0_handler", "systick_body"], 2: ["usb_handler"], 3: ["dma0_handler", "timer1_handler"]}

# Callers through a pointer, and their possible targets. The first match counts; names are mangled.
POINTERS = [
    (r"PicoEngine9set_trips", r"PinCapture11watch_trips"),
    (r"PicoEngine4idle", r"PinCapture9caught_up"),
    (r"4pico.*(enter_xip|replace_sector|ask_unique_id|PicoSystem6reboot)", "ROM"),
    (r"begin_in_ram", r"_GLOBAL__sub_I"),
    (r"(^|[/:])(pb_|decode_|encode_)|pb_(en|de)code\.c", r"\.c:buf_(read|write)$|pb_default_field_callback$"),
    (r"firmware4Link9take_data", r"Core10take_chunk"),
    (r"firmware4Link1?\d?take_(request|sync|urgent)", r"Core6answer"),
    (r"firmware4Link", r"9UsbDevice(4read|4room|5write)"),
    (r"6symrig8firmware", r"^_ZNK?6symrig4pico(9TickClock3now|10PicoEngine(?!5begin|7service|4trip|4fall|15program)|10PinCapture(?!6handle|5begin)|9UsbDevice(4read|4room|5write|8attached)|14PicoFaultStore|12PicoWatchdog4feed|13PicoIndicator4show|12PicoSettings|10PicoSystem)"),
]


class Graph:
    def __init__(self):
        self.frames = {}
        self.calls = collections.defaultdict(set)
        self.problems = []

    def read(self, path):
        text = path.read_text(encoding="utf-8")
        for title, label in NODE.findall(text):
            frame = FRAME.search(label)
            if frame is None:
                continue
            if frame.group(2) != "static" and "bounded" not in frame.group(0):
                self.problems.append(f"{title}: its frame has no fixed size")
            self.frames[title] = max(int(frame.group(1)), self.frames.get(title, 0))
        for source, target in EDGE.findall(text):
            self.calls[source].add(target)

    def resolve(self):
        """Puts what a pointer may point at in place of each call through one."""
        for source, targets in self.calls.items():
            if INDIRECT not in targets:
                continue
            targets.discard(INDIRECT)
            pattern = next((to for of, to in POINTERS if re.search(of, source)), None)
            found = {"ROM"} if pattern == "ROM" else {name for name in self.frames if pattern and re.search(pattern, name)}
            if not found:
                self.problems.append(f"{source} calls through a pointer, and POINTERS does not say whom")
            targets |= found

    def frame(self, name):
        return ROM if name == "ROM" else self.frames.get(name, LEAVES.get(name, LIBRARY))

    def components(self):
        """Tarjan's strongly connected components, callees first; without recursion, for Python's sake."""
        index, low, on, stack, found = {}, {}, set(), [], []
        names = set(self.frames) | {name for targets in self.calls.values() for name in targets}
        for root in sorted(names):
            if root in index:
                continue
            work = [(root, iter(sorted(self.calls.get(root, ()))))]
            index[root] = low[root] = len(index)
            stack.append(root)
            on.add(root)
            while work:
                name, targets = work[-1]
                follow = next(targets, None)
                if follow is None:
                    work.pop()
                    if work:
                        low[work[-1][0]] = min(low[work[-1][0]], low[name])
                    if low[name] == index[name]:
                        component = []
                        while not component or component[-1] != name:
                            component.append(stack.pop())
                            on.discard(component[-1])
                        found.append(component)
                elif follow not in index:
                    index[follow] = low[follow] = len(index)
                    stack.append(follow)
                    on.add(follow)
                    work.append((follow, iter(sorted(self.calls.get(follow, ())))))
                elif follow in on:
                    low[name] = min(low[name], index[follow])
        return found

    @staticmethod
    def turns(component):
        return NESTED["decode" if any("decode" in name for name in component) else "encode"]

    def depths(self):
        """Name -> (bytes from its frame down, the path)."""
        depth = {}
        for component in self.components():
            loop = len(component) > 1 or component[0] in self.calls.get(component[0], ())
            if loop and not all(re.search(r"pb_|nanopb|decode_|encode_", name) for name in component):
                self.problems.append("can call itself: " + ", ".join(sorted(component)))
            own = sum(self.frame(name) for name in component) * (self.turns(component) if loop else 1)
            below = max(
                (depth[to] for name in component for to in self.calls.get(name, ()) if to not in component),
                default=(0, ()),
            )
            for name in component:
                depth[name] = (own + below[0], ((name, own), *below[1]))
        return depth


def short(name):
    return name.rsplit(":", 1)[-1]


def main(arguments):
    if not arguments:
        sys.exit(__doc__)
    with open(HERE / "board.toml", "rb") as file:
        limit = tomllib.load(file)["resources"]["stack_limit"]
    room = int(re.search(r"STACK.*LENGTH = (\d+)$", (HERE / "link.ld").read_text(encoding="utf-8"), re.M).group(1)) - GUARD
    graph = Graph()
    paths = sorted(pathlib.Path(arguments[0]).rglob("*.ci"))
    for path in paths:
        graph.read(path)
    graph.resolve()
    depth = graph.depths()
    own, way = depth["reset_handler"]
    levels = {level: max(depth[name] for name in names) for level, names in INTERRUPTS.items()}
    whole = own + sum(deepest + EXCEPTION_FRAME for deepest, _ in levels.values()) + CRASH
    if whole > limit:
        graph.problems.append(f"with every interrupt on top {whole} bytes of stack are needed, more than {limit}")
    if whole > room:
        graph.problems.append(f"with interrupts on top {whole} bytes are needed, and link.ld gives {room}")
    if "--show" in arguments or graph.problems:
        for title, (_, path) in {"main": (own, way), **{f"interrupts {k}": v for k, v in levels.items()}}.items():
            print(f"{title}:")
            for name, size in path:
                print(f"  {size:5} {short(name)}")
    for problem in graph.problems:
        print(f"check_stack: {problem}")
    print(f"check_stack: main {own}, with interrupts {whole} of {limit} bytes ({len(paths)} files)")
    return 1 if graph.problems or not paths else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
