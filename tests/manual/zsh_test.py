#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Types command lines and a tab into a real zsh, and reads what the tab made of them.

usage: zsh_test.py SYMRIG MANUAL
"""

import os
import pathlib
import pty
import re
import select
import shutil
import sys
import tempfile
import time

import help_lists

# A key shows the line: [[line]]. Another one empties it.
SETUP = r"""
PS1='> '; unsetopt zle_bracketed_paste; fpath=("$MANUAL" $fpath); autoload -U compinit; compinit -u -D
setopt no_beep no_auto_menu no_list_ambiguous; unsetopt auto_list prompt_cr prompt_sp
show() { print -r -- "[[$BUFFER]]"; BUFFER=; zle redisplay }
zle -N show; bindkey '^X' show; bindkey '^I' expand-or-complete
print re""ady
"""

# Line before the tab: line after it.
LINES = {
    "symrig capt": "symrig capture ",
    "symrig capture --alg": "symrig capture --algorithm=",
    "symrig capture --algorithm br": "symrig capture --algorithm brute ",
    "symrig capture --algorithm=br": "symrig capture --algorithm=brute ",
    "symrig capture --rig sim:gum": "symrig capture --rig sim:gummy ",
    "symrig relight sce": "symrig relight scene.h5 ",
    "symrig relight scene.h5 --light lett": "symrig relight scene.h5 --light letters ",
    "symrig relight scene.h5 --light oth": "symrig relight scene.h5 --light other.txt ",
    "symrig relight oth": "symrig relight other.txt ",  # no file of the type: any file
    "symrig calibrate --from fol": "symrig calibrate --from folder/",
    "symrig bench --scenes plane,gum": "symrig bench --scenes plane,gummy,",
    "symrig help inf": "symrig help info ",
}


class Shell:
    def __init__(self, folder, manual):
        self.child, self.screen = pty.fork()
        if self.child == 0:
            os.chdir(folder)
            os.execvpe("zsh", ["zsh", "-f", "-i"], {**os.environ, "MANUAL": manual, "TERM": "dumb", "HOME": folder})
        self.type(SETUP)
        self.wait_for("ready\r\n")

    def type(self, text):
        os.write(self.screen, text.encode())

    def wait_for(self, pattern):
        """All text until the pattern; a shell that hangs ends the test."""
        text, end = "", time.monotonic() + 60
        while time.monotonic() < end:
            if select.select([self.screen], [], [], 1)[0]:
                text += os.read(self.screen, 65536).decode(errors="replace")
            if re.search(pattern, text):
                return text
        sys.exit(f"zsh did not show {pattern!r}: {text!r}")

    def completed(self, line):
        self.type(line + "\t\x18")
        return re.search(r"\[\[(.*)\]\]", self.wait_for(r"\[\[.*\]\]\r?\n"))[1]


def option_faults(symrig, manual):
    """Every option of the help is in the function."""
    text = (manual / "_symrig").read_text(encoding="utf-8")
    for command, options in help_lists.all_options(symrig).items():
        block = text[text.index("_symrig() {") :] if not command else text[text.index(f"\n    {command})\n") :]
        block = block.split(";;")[0].split("case $line")[0]
        named = set(re.findall(r"(?<![\w-])(--?[a-zA-Z][\w-]*)(?==|\+|\[|,|\})", block))
        if named - options or options - named:
            yield f"_symrig: options of '{command}' differ from the help by {sorted(named ^ options)}"


def main():
    if not shutil.which("zsh"):
        print("zsh is not installed")
        sys.exit(77)
    symrig, manual = sys.argv[1], pathlib.Path(sys.argv[2]).resolve()
    faults = list(option_faults(symrig, manual))
    with tempfile.TemporaryDirectory() as folder:
        for name in ("scene.h5", "other.txt"):
            (pathlib.Path(folder) / name).touch()
        (pathlib.Path(folder) / "folder").mkdir()
        shell = Shell(folder, str(manual))
        for line, wanted in LINES.items():
            found = shell.completed(line)
            if found != wanted:
                faults.append(f"'{line}' became '{found}', not '{wanted}'")
    help_lists.finish(faults)


if __name__ == "__main__":
    main()
