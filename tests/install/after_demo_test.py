# SPDX-License-Identifier: Apache-2.0
"""What the tutorial installs exists where only tools/demo has run: each file is built by the demo, or by a command of the tutorial.

usage: after_demo_test.py BUILD DEMO TUTORIAL
"""

import pathlib
import re
import subprocess
import sys


def ninja(build, *words):
    return subprocess.run(["ninja", "-C", build, *words], check=True, capture_output=True, text=True).stdout.splitlines()


def installed(build, component):
    """The files of a component that stand in the build folder, as ninja names them."""
    block = re.compile(rf'^if\(CMAKE_INSTALL_COMPONENT STREQUAL "{component}".*?^endif\(\)', re.MULTILINE | re.DOTALL)
    for script in build.rglob("cmake_install.cmake"):
        for text in block.findall(script.read_text()):
            for path in re.findall(rf'"({re.escape(str(build))}/[^"]+)"', text):
                yield str(pathlib.Path(path).relative_to(build))


def main():
    build, demo, tutorial = (pathlib.Path(word) for word in sys.argv[1:])
    text = tutorial.read_text()
    targets = re.findall(r"^ *build build/release (\w+)$", demo.read_text(), re.MULTILINE)
    for command in re.findall(r"^cmake --build \S+/release --target (.+)$", text, re.MULTILINE):
        targets += command.split()
    installs = re.findall(r"^cmake --install .*$", text, re.MULTILINE)
    components = [re.search(r"--component (\w+)", line) for line in installs]
    assert targets and components and all(components), f"an installation of all components: {installs}"
    makes = {line.rsplit(": ", 1)[0] for line in ninja(build, "-t", "targets", "all")}
    made = set(ninja(build, "-t", "inputs", *targets))
    for target in targets:
        made |= {line.strip() for line in ninja(build, "-t", "query", target)}
    wanted = {path for one in components for path in installed(build, one[1]) if path in makes}
    assert wanted, "no file is installed"
    # A shared library and its links are made together.
    plain = {re.sub(r"\.so[.\d]*$", ".so", path) for path in made}
    missing = sorted(path for path in wanted if re.sub(r"\.so[.\d]*$", ".so", path) not in plain)
    assert not missing, f"the tutorial installs what neither tools/demo nor the tutorial builds: {missing}"
    print(f"{len(wanted)} files of {len(components)} components are built by {' '.join(targets)}")


if __name__ == "__main__":
    main()
