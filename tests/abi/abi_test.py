#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compares the C interface with the one of the last release, tests/abi/libsymrig.abi, by libabigail.

usage: abi_test.py check WITH_DEBUG_INFORMATION INSTALLED   the two libraries of this build
       abi_test.py plant COMPILER                           plants incompatible changes, which must be found
       abi_test.py write COMPILER                           writes libsymrig.abi from symrig.h: only for a release

Exit status 77: abidiff is not installed (Debian: abigail-tools).
"""

import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
RELEASED = HERE / "libsymrig.abi"
HEADER = ROOT / "host/include/symrig/symrig.h"
MAP = ROOT / "host/src/capi/exported_symbols.map"
# abidiff's exit status is a sum; an added function only sets the bit 4.
INCOMPATIBLE = 1 | 2 | 8


def run(*words):
    return subprocess.run([str(word) for word in words], capture_output=True, text=True, check=False)


def difference(new):
    """abidiff's report if `new` breaks programs of the last release, or None."""
    found = run("abidiff", "--suppressions", HERE / "opaque.abignore", "--no-show-locs", RELEASED, new)
    changed = found.returncode & 4 and not re.search(r"^Functions changes summary: 0 Removed, 0 Changed", found.stdout, re.MULTILINE)
    return found.stdout + found.stderr if found.returncode & INCOMPATIBLE or changed else None


def symbols(library):
    """Versioned symbols that the library shows."""
    lines = run("nm", "-D", "--defined-only", library).stdout.splitlines()
    return {line.split()[-1].replace("@@", "@") for line in lines if " A " not in line}


def promised():
    text = re.sub(r"/\*.*?\*/", "", HEADER.read_text(encoding="utf-8"), flags=re.DOTALL)
    names = set(re.findall(r"^[a-z][a-z0-9_ ]*\*? ?(symrig_[a-z_]+)\(", text, re.MULTILINE))
    assert len(names) >= 17, names
    return names


def debian_symbols():
    text = (ROOT / "debian/libsymrig0.symbols").read_text(encoding="utf-8")
    return {name for name in re.findall(r"^ (\S+@\S+) ", text, re.MULTILINE) if name.startswith("symrig_")}


def check(with_debug, installed):
    faults = []
    shown = symbols(installed)
    if {name.split("@")[0] for name in shown} != promised():
        faults.append(f"libsymrig.so.0 shows {sorted(shown)}, and symrig.h declares {sorted(promised())}; see exported_symbols.map")
    if shown != debian_symbols():
        faults.append(f"debian/libsymrig0.symbols differs from the library by {sorted(shown ^ debian_symbols())}")
    if shown != symbols(with_debug):
        faults.append("the library that is compared shows other symbols than the one that is installed")
    report = difference(with_debug)
    if report:
        faults.append(f"programs of the last release would break; this needs libsymrig.so.1\n{report}")
    return faults


# A changed header stands for a changed library: (what, pattern, replacement) of symrig.h.
PLANTED = [
    ("a parameter of another type", r"(symrig_tensor_relight\(const symrig_tensor\* tensor, const )float", r"\1double"),
    ("a result of another type", r"uint32_t symrig_api_version", "uint64_t symrig_api_version"),
    ("a member in the middle", r"(  uint64_t marks;)", r"  uint64_t retries;\n\1"),
    ("a larger text", r"char what\[512\]", "char what[1024]"),
    ("a function that is gone", r"^int symrig_board_abort\([^;]*;", ""),
    ("a member in the middle of what a callback gets", r"(  float\* variance;)", r"  float* weight;\n\1"),
    ("a member in the middle of what a caller fills", r"(  const char\* name; )", r"  int32_t kind;\n\1"),
]


def version_script(names):
    """The nodes of exported_symbols.map with these functions alone. One that the map lacks goes to the newest node."""
    text = re.sub(r"/\*.*?\*/", "", MAP.read_text(encoding="utf-8"), flags=re.DOTALL)
    nodes = {node: set(re.findall(r"\bsymrig_\w+", body)) for node, body in re.findall(r"(\w+) \{([^}]*)\}", text)}
    assert len(nodes) >= 2 and all(nodes.values()), nodes
    nodes[list(nodes)[-1]] |= set(names) - set().union(*nodes.values())
    script, before = "", ""
    for node, functions in nodes.items():
        kept = "".join(f"{name}; " for name in sorted(functions & set(names)))
        script += f"{node} {{ global: {kept}{'' if before else 'local: *; '}}} {before};\n"
        before = node
    return script


def built(folder, compiler, header):
    """A library whose functions do nothing but have the types of this header."""
    (folder / "symrig").mkdir(parents=True)
    (folder / "symrig/symrig.h").write_text(header, encoding="utf-8")
    plain = re.sub(r"/\*.*?\*/", "", header, flags=re.DOTALL)
    bodies = re.findall(r"^((?:int|void|uint32_t|uint64_t|const char\*|symrig_shape) symrig_[a-z_]+\([^;]*\));", plain, re.MULTILINE)
    source = '#include "symrig/symrig.h"\n' + "".join(body + " { __builtin_trap(); }\n" for body in bodies)
    (folder / "empty.cpp").write_text(source, encoding="utf-8")
    names = re.findall(r"(symrig_[a-z_]+)\(", "\n".join(bodies))
    (folder / "map").write_text(version_script(names), encoding="utf-8")
    made = run(compiler, "-g", "-shared", "-fPIC", "-w", f"-I{folder}", f"-Wl,--version-script={folder / 'map'}",
               "-Wl,-soname,libsymrig.so.0", folder / "empty.cpp", "-o", folder / "libsymrig.so.0")  # fmt: skip
    assert made.returncode == 0, made.stderr
    return folder / "libsymrig.so.0"


def plant(compiler):
    header = HEADER.read_text(encoding="utf-8")
    faults = []
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        report = difference(built(folder / "same", compiler, header))
        if report:
            faults.append(f"the unchanged header differs from the last release:\n{report}")
        for k, (what, pattern, replacement) in enumerate(PLANTED):
            changed = re.sub(pattern, replacement, header, count=1, flags=re.MULTILINE)
            assert changed != header, what
            if not difference(built(folder / str(k), compiler, changed)):
                faults.append(f"not found: {what}")
        added = header.replace("#ifdef __cplusplus\n}", "int symrig_added(int how);\n#ifdef __cplusplus\n}")
        report = difference(built(folder / "added", compiler, added))
        if added == header or report:
            faults.append(f"an added function is compatible, but was found:\n{report}")
    return faults


def write(compiler):
    with tempfile.TemporaryDirectory() as name:
        library = built(pathlib.Path(name) / "release", compiler, HEADER.read_text(encoding="utf-8"))
        made = run("abidw", "--short-locs", "--no-corpus-path", "--no-comp-dir-path", "--no-elf-needed", "--out-file", RELEASED, library)
    return [made.stderr] if made.returncode else []


def main():
    if not shutil.which("abidiff"):
        print("abidiff is not installed (Debian: abigail-tools)")
        return 77
    faults = {"check": check, "plant": plant, "write": write}[sys.argv[1]](*sys.argv[2:])
    print("\n".join(faults) if faults else "as in the last release")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
