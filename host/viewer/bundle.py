# SPDX-License-Identifier: Apache-2.0
"""Makes one HTML page of the files in page/, or C++ source that holds it.

usage: bundle.py --html FILE | --cpp FILE

page.html has the marks @STYLE@ and @SCRIPT@. The script is main.js with all modules that it imports, each once, in the order of
the imports. A module uses only these two forms:
    import { name, name } from "./file.js";       (one line)
    export function name / export class name / export const name
All modules share one scope, so a name at the top of one file must not be at the top of another. The bundle fails on it.
--cpp also writes the kernel's module (kernel/relight_kernel.wasm).
"""

import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
IMPORT = re.compile(r'^import \{([^}]*)\} from "\./([\w.]+)";$', re.MULTILINE)
TOP_NAME = re.compile(r"^(?:export )?(?:async )?(?:function\*?|class|const|let)\s+(\w+)", re.MULTILINE)
HEAD = "// SPDX-License-Identifier: Apache-2.0\n"


class Fault(Exception):
    pass


def modules(name, found):
    """Adds the text of a module and of all that it imports, those first."""
    if name in found:
        return
    text = (HERE / "page" / name).read_text(encoding="utf-8").removeprefix(HEAD)
    found[name] = None
    for names, other in IMPORT.findall(text):
        modules(other, found)
        exported = {match for match in re.findall(r"^export (?:async )?(?:function|class|const)\s+(\w+)", source(other), re.MULTILINE)}
        for wanted in filter(None, (one.strip() for one in names.split(","))):
            if wanted not in exported:
                raise Fault(f"{name}: {other} exports no {wanted}")
    body = IMPORT.sub("", text)
    if re.search(r"^import\b", body, re.MULTILINE):
        raise Fault(f"{name}: an import that this script does not know")
    found.pop(name)
    found[name] = body


def source(name):
    return (HERE / "page" / name).read_text(encoding="utf-8")


def script():
    found = {}
    modules("main.js", found)
    owners = {}
    for name, text in found.items():
        for top in TOP_NAME.findall(text):
            if top in owners:
                raise Fault(f"{name}: {top} is also at the top of {owners[top]}")
            owners[top] = name
    body = "\n".join(re.sub(r"^export ", "", text, flags=re.MULTILINE).strip() for text in found.values())
    return f'(() => {{\n"use strict";\n{body}\n}})();\n'


def page():
    style = re.sub(r"/\*.*?\*/\s*", "", source("page.css"), flags=re.DOTALL)
    html = re.sub(r"^<!-- SPDX.*?-->\n", "", source("page.html"), flags=re.MULTILINE)
    for mark, text in (("@STYLE@", style), ("@SCRIPT@", script())):
        if "@POLICY@" in text or "</script" in text.lower() or html.count(mark) != 1:
            raise Fault(f"page.html: {mark} does not fit")
        html = html.replace(mark, text)
    return html


def array(name, data):
    lines = [",".join(map(str, data[k : k + 32])) for k in range(0, len(data), 32)]
    return f"constexpr unsigned char {name}[] = {{\n" + ",\n".join(lines) + "};\n"


def cpp():
    kernel = (HERE / "kernel" / "relight_kernel.wasm").read_bytes()
    view = "{{reinterpret_cast<const char*>({0}), sizeof({0})}}"
    return (
        HEAD
        + '// Made by host/viewer/bundle.py.\n#include "viewer/page_text.hpp"\n\nnamespace symrig::viewer {\nnamespace {\n\n'
        + array("kPage", page().encode())
        + array("kKernel", kernel)
        + "\n}  // namespace\n\n"
        + f"std::string_view page_template() {{ return {view.format('kPage')}; }}\n"
        + f"std::string_view kernel_module() {{ return {view.format('kKernel')}; }}\n\n}}  // namespace symrig::viewer\n"
    )


def main(arguments):
    if len(arguments) != 2 or arguments[0] not in ("--html", "--cpp"):
        print(__doc__, file=sys.stderr)
        return 2
    try:
        text = page() if arguments[0] == "--html" else cpp()
    except Fault as fault:
        print(f"bundle.py: {fault}", file=sys.stderr)
        return 1
    pathlib.Path(arguments[1]).write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
