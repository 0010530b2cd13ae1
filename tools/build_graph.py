# SPDX-License-Identifier: Apache-2.0
"""What each test of a configured build is made of, read from Ninja and CTest. Nothing needs to be built for that.

Ninja knows the command of each output. A command names its sources, its objects and its archives; the sources name the headers that
they include. A script stands for all scripts of its folder. From that come two answers:

- the whole code of a test: all that its programs link and start, without comments. If that is the same, the test has the same result.
- its own code: its scripts, its data, the objects that belong to its programs alone with every header that these read, and the folders
  that it is about (symrig_about in tests/CMakeLists.txt). Not the sources of a library that it merely links: the tests about that
  library are for these.
"""

import functools
import hashlib
import json
import pathlib
import re
import shlex
import subprocess
import typing

import sources

INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*["<]([^">]+)[">]', re.MULTILINE)
FOLDER_OF_HEADERS = re.compile(r"(?:-I|-isystem ?)(/\S+)")
TEST = re.compile(r"^add_test\(\[=\[(.*?)\]=\](.*)\)$", re.MULTILINE)
PROPERTIES = re.compile(r"^set_tests_properties\(\[=\[(.*?)\]=\] PROPERTIES (.*)\)$", re.MULTILINE)
QUOTED = re.compile(r'"((?:[^"\\]|\\.)*)"')
PROPERTY = re.compile(r'(\w+) "((?:[^"\\]|\\.)*)"')
# A script has no suffix or one of these. What else is in its folder may be what it reads; C++ is known by the programs made of it.
SCRIPTS = {"", ".py", ".sh", ".mjs", ".cmake"}
NOT_READ_BY_SCRIPTS = {".cpp", ".hpp", ".h", ".c", ".txt", ".md"}
COMPILED = {".c", ".cpp", ".h", ".hpp"}
# Texts in quotes, where no comment begins (an apostrophe after a digit separates digits), and comments.
QUOTED_OR_COMMENT = re.compile(
    r'''R"([^\s(]*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|(?<![0-9A-Fa-f])'(?:\\.|[^'\\\n])*'|//[^\n]*|/\*.*?\*/''', re.DOTALL
)
BENCH = ["run", "prepare", "host", "guest", "make", "modules"]  # of tests/bench-vm: what boots each guest


class Test(typing.NamedTuple):
    """A test of CTest."""

    name: str
    words: tuple  # its command, its environment and its folder
    labels: frozenset


class Graph:
    """A configured build of a tree. Paths in commands are kept as BUILD/... and TREE/..., so that two trees compare."""

    def __init__(self, tree, build, tracked=None):
        self.tree, self.build = pathlib.Path(tree).resolve(), pathlib.Path(build).resolve()
        printed = subprocess.run(["ninja", "-C", self.build, "-t", "compdb"], capture_output=True, text=True, check=True).stdout
        edges = json.loads(printed[printed.index("[") :])
        self.commands = {edge["output"]: edge["command"] for edge in edges if edge["command"] and "cmake_install" not in edge["command"]}
        self.commands.update(self.second_outputs())
        self.tracked = set(tracked or map(str, sources.files(self.tree)))
        self.header_folders = sorted(
            {path for command in self.commands.values() for path in FOLDER_OF_HEADERS.findall(command) if path.startswith(str(self.tree))}
        )
        self.tests = {test.name: test for test in read_tests(self.build)}

    def second_outputs(self):
        """Files that a command generates beside its first output: their inputs stand for the command, which Ninja lists once."""
        listed = subprocess.run(["ninja", "-C", self.build, "-t", "targets", "all"], capture_output=True, text=True, check=True).stdout
        names = [line.removesuffix(": CUSTOM_COMMAND") for line in listed.splitlines() if line.endswith(": CUSTOM_COMMAND")]
        names = [name for name in names if name not in self.commands and "." in name and "CMakeFiles/" not in name]
        if not names:
            return {}
        asked = subprocess.run(["ninja", "-C", self.build, "-t", "query", *names], capture_output=True, text=True, check=True).stdout
        blocks = re.findall(r"^(\S.*):\n  input: CUSTOM_COMMAND\n((?:    .*\n)*)", asked, re.MULTILINE)
        return {name: " ".join(line.strip(" |") for line in inputs.splitlines()) for name, inputs in blocks}

    def plain(self, text):
        """A text without the places of tree and build."""
        return text.replace(str(self.build), "BUILD").replace(str(self.tree), "TREE")

    @functools.cache
    def digest(self, path):
        """The hash of a file's text, as it is in either tree."""
        try:
            text = pathlib.Path(path).read_bytes()
        except OSError:
            return ""
        return hashlib.sha256(self.plain(text.decode("utf-8", "replace")).encode()).hexdigest()

    @functools.cache
    def compiled_digest(self, path):
        """The hash of what a compiler reads of a file: no comments, no empty lines."""
        if pathlib.Path(path).suffix not in COMPILED or not pathlib.Path(path).is_file():
            return self.digest(path)
        text = pathlib.Path(path).read_text(encoding="utf-8", errors="replace")
        return hashlib.sha256(self.plain(without_comments(text)).encode()).hexdigest()

    @functools.cache
    def output(self, path):
        """The output of Ninja that a path names, or None."""
        path = path.removeprefix(str(self.build) + "/")
        return path if path in self.commands else None

    @functools.cache
    def included(self, path):
        """The files of the tree or the build that a file includes itself. A file that Ninja makes is not read: it may not be there yet."""
        if self.output(path):
            return ()
        try:
            names = INCLUDE.findall(pathlib.Path(path).read_text(encoding="utf-8", errors="replace"))
        except OSError:
            return ()
        places = [str(pathlib.Path(path).parent), *self.header_folders]
        found = []
        for name in names:
            options = [name] if name.startswith("/") else [f"{place}/{name}" for place in places]
            found += [str(pathlib.Path(option).resolve()) for option in options if self.output(option) or pathlib.Path(option).is_file()]
        return tuple(sorted({path for path in found if path.startswith(str(self.tree))}))

    def closure(self, paths):
        """These files and all that they include, directly or through others."""
        found, waiting = set(), list(paths)
        while waiting:
            path = waiting.pop()
            if path not in found:
                found.add(path)
                waiting += self.included(path)
        return found

    @functools.cache
    def words(self, output):
        """The words of a command that are paths of the tree or the build. -I and -isystem are only places to look at."""
        command = self.commands[output]
        try:
            words = shlex.split(command)
        except ValueError:
            words = command.split()
        paths = []
        for before, word in zip(["", *words], words):
            if before == "-isystem" or before in {"-MF", "-MT", "-o"} or word.startswith("-I"):
                continue
            paths += self.paths_in(word)
        return tuple(paths)

    def paths_in(self, word):
        """Paths of the tree or the build in a word: alone, after a '=', or between ':' and ';'."""
        parts = re.split(r'[=:;,"\\]', word)
        absolute = [part for part in parts if part.startswith(str(self.tree)) or part.startswith(str(self.build))]
        return absolute or [part for part in parts if part in self.commands]

    def folder_files(self, folder, keep=lambda name: True):
        """The tracked files below a folder of the tree."""
        below = str(pathlib.Path(folder).relative_to(self.tree)) + "/"
        return {str(self.tree / name) for name in self.tracked if name.startswith(below) and keep(name)}

    def files_of(self, path):
        """The files of the tree that a path stands for: itself, or all below it. The whole tree stands for none."""
        where = pathlib.Path(path)
        if where == self.tree or self.build in [where, *where.parents] or not where.is_relative_to(self.tree):
            return set()
        if where.is_dir():
            return self.folder_files(where)
        return {str(where)} if str(where.relative_to(self.tree)) in self.tracked else set()

    def compiles(self, output):
        return " -c " in self.commands[output]

    @functools.cache
    def parts(self, output):
        """What a compiled or generated output is made of: path -> hash, and '' -> its command."""
        read = set(self.words(output)) - {output}
        if self.compiles(output):
            read = self.closure(path for path in read if pathlib.Path(path).is_file() or self.output(path)) | read
        made = {"": hashlib.sha256(self.plain(self.commands[output]).encode()).hexdigest()}
        # A generator may read comments: the version of the firmware is the hash of its files.
        digest = self.compiled_digest if self.compiles(output) else self.digest
        for path in read:
            other = self.output(path)
            if other and other != output and not self.links(other):
                made.update({f"{other}: {key}": value for key, value in self.parts(other).items()})
            elif not other and str(path).startswith(str(self.build)):
                made[self.plain(str(path))] = digest(path)
            elif not other:
                # A folder stands for all that a generator may read there, but no generator reads our pages.
                files = [file for file in self.files_of(path) if file == path or not file.endswith(".md")]
                made.update({self.plain(file): digest(file) for file in files})
        return made

    def links(self, output):
        """Is it a program, a library or a module: made of objects?"""
        return any(word.endswith(".o") for word in self.words(output)) and not self.compiles(output)

    @functools.cache
    def made_of(self, output, whole):
        """What a program is made of, as in parts(), with the programs that it starts; `whole`: also with the objects of archives."""
        made, waiting, seen = {}, [output], set()
        while waiting:
            program = waiting.pop()
            if program in seen or (program.endswith(".a") and not whole):
                continue
            seen.add(program)
            if not self.links(program):
                made.update({f"{program}: {key}": value for key, value in self.parts(program).items()})
                continue
            made[f"{program}: "] = hashlib.sha256(self.plain(self.commands[program]).encode()).hexdigest()
            used = {self.output(word) for word in self.words(program)} - {None, program}
            for obj in [other for other in used if other.endswith(".o")]:
                made.update({f"{obj}: {key}": value for key, value in self.parts(obj).items()})
                used |= {self.output(path) for path in self.words(obj)} - {None}
            waiting += [other for other in used if not other.endswith(".o") and self.links(other)]
        return made

    def everything(self):
        """All that is compiled for the product."""
        outputs = [output for output in self.commands if self.compiles(output) and not output.startswith("tests/")]
        return {f"{obj}: {key}": value for obj in outputs for key, value in self.parts(obj).items()}

    def code(self, name, whole):
        """What a test is made of: path -> hash. `whole`: all of it; otherwise its own code."""
        test = self.tests[name]
        made = {"": self.plain(repr(test.words))}
        files = set()
        if "bench" in test.labels:
            for part in BENCH:
                files |= self.files_of(self.tree / "tests" / "bench-vm" / part)
        for label in test.labels:
            if label.startswith("about:"):
                about = self.folder_files(self.tree / label.removeprefix("about:"), lambda file: not file.endswith(".md"))
                made.update({self.plain(file): self.compiled_digest(file) for file in about})
        for path in self.places(test):
            if path in {str(self.build), str(self.tree)}:
                made.update(self.everything() if whole and path == str(self.build) else {})
                files |= {str(self.tree / name) for name in self.tracked} if whole and path == str(self.tree) else set()
                continue
            for output in self.outputs_at(path):
                made.update(self.made_of(output, whole))
            here = self.files_of(path)
            if here == {path} and pathlib.Path(path).suffix in SCRIPTS:
                here |= self.folder_files(pathlib.Path(path).parent, lambda file: pathlib.Path(file).suffix not in NOT_READ_BY_SCRIPTS)
            files |= here
        # What a script reads, it may read with its comments.
        made.update({self.plain(file): self.digest(file) for file in files})
        return made

    def places(self, test):
        """The paths of the tree and the build that a test names."""
        return {str(pathlib.Path(path).resolve()) for word in test.words for path in self.paths_in(word)}

    def outputs_at(self, path):
        """The outputs of Ninja that a path of the build stands for: itself, or the programs below it."""
        if self.output(path):
            return {self.output(path)}
        if not pathlib.Path(path).is_relative_to(self.build) or path == str(self.build):
            return set()
        return {output for output in self.commands if f"{self.build}/{output}".startswith(path + "/") and self.links(output)}

    def programs_of(self, name):
        """The outputs of Ninja that a test needs."""
        return set().union(*(self.outputs_at(path) for path in self.places(self.tests[name])))


def without_comments(text):
    """The lines of C or C++ that are not empty, without comments."""
    kept = QUOTED_OR_COMMENT.sub(lambda found: " " if found[0].startswith("/") else found[0], text)
    return "\n".join(line.rstrip() for line in kept.splitlines() if line.strip())


def read_tests(build):
    """The tests of CTest. `ctest --show-only` does not say the command of a program that is not built."""
    for file in sorted(pathlib.Path(build).rglob("CTestTestfile.cmake")):
        if "CMakeFiles" in file.parts:
            continue
        text = file.read_text(encoding="utf-8")
        properties = {name: dict(PROPERTY.findall(rest)) for name, rest in PROPERTIES.findall(text)}
        for name, rest in TEST.findall(text):
            had = properties.get(name, {})
            words = QUOTED.findall(rest) + [had.get(key, "") for key in ("ENVIRONMENT", "REQUIRED_FILES")]
            # A test begins in a folder of the build to have a place for its files; in a folder of the tree, it reads that.
            words += [place for place in [had.get("WORKING_DIRECTORY", "")] if not place.startswith(str(build))]
            yield Test(name, tuple(words), frozenset(filter(None, had.get("LABELS", "").split(";"))))


def different(new, old):
    """The keys of two codes that differ. What is gone counts for scripts and data; a source that is gone has changed what named it."""
    return {key for key in new if new[key] != old.get(key)} | {key for key in old.keys() - new.keys() if key.startswith("TREE/")}
