# SPDX-License-Identifier: Apache-2.0
"""What tools/plan adds to a landing, in a small project of its own: exactly the tests whose code has changed. And the tables of
CONTRIBUTING.md name the tests that have the label `full`.

usage: plan_test.py RELEASE_BUILD
"""

import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import build_graph  # noqa: E402

RELEASE = pathlib.Path(sys.argv.pop())

FILES = {
    "CMakeLists.txt": """cmake_minimum_required(VERSION 3.25)
project(small CXX)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
enable_testing()
include_directories(include)
add_library(light STATIC light/light.cpp)
add_library(dark STATIC dark/dark.cpp)
add_executable(command command.cpp)
target_link_libraries(command light dark)
foreach(name light dark)
  add_executable(test_${name} tests/${name}_test.cpp)
  target_link_libraries(test_${name} light dark)
  add_test(NAME ${name} COMMAND test_${name})
  set_tests_properties(${name} PROPERTIES LABELS "full;about:${name}")
endforeach()
add_test(NAME script COMMAND ${PROJECT_SOURCE_DIR}/scripts/run $<TARGET_FILE:command>)
set_tests_properties(script PROPERTIES LABELS full)
add_executable(test_always tests/always_test.cpp)
add_test(NAME always COMMAND test_always)
""",
    "CMakePresets.json": json.dumps(
        {"version": 6, "configurePresets": [{"name": "release", "generator": "Ninja", "binaryDir": "${sourceDir}/build/release"}]}
    ),
    "include/light.hpp": "int light();\n",
    "include/dark.hpp": "int dark();\n",
    "light/light.cpp": '#include "light.hpp"\nint light() { return 1; }\n',
    "dark/dark.cpp": '#include "dark.hpp"\nint dark() { return 0; }\n',
    "command.cpp": '#include "dark.hpp"\nint main() { return dark(); }\n',
    "tests/light_test.cpp": '#include "light.hpp"\nint main() { return light() - 1; }\n',
    "tests/dark_test.cpp": '#include "dark.hpp"\nint main() { return dark(); }\n',
    "tests/always_test.cpp": "int main() { return 0; }\n",
    "scripts/run": '#!/bin/sh\n. "$(dirname "$0")/lib.sh"\n',
    "scripts/lib.sh": "true\n",
    "README.md": "small\n",
    ".gitignore": "build/\nout/\n__pycache__/\n",
}


class Project:
    """A copy of the tools in a small tree with a proven commit."""

    def __init__(self, folder):
        self.root = pathlib.Path(folder)
        (self.root / "tools").mkdir()
        for name in ("plan", "build_graph.py", "sources.py"):
            shutil.copy(ROOT / "tools" / name, self.root / "tools" / name)
        self.write(FILES)
        self.git("init", "-q")
        self.commit()
        head = self.git("rev-parse", "HEAD")
        self.write({".ci/proven": f"commit {head}date 2026-11-28\nrelease light 1.0\nrelease dark 60.0\nrelease script 1.0\n"})
        self.commit()

    def write(self, files):
        for name, text in files.items():
            path = self.root / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
            path.chmod(0o755)

    def git(self, *words):
        who = ["-c", "user.name=someone", "-c", "user.email=someone@example.org"]
        return subprocess.run(["git", *who, *words], cwd=self.root, check=True, capture_output=True, text=True).stdout

    def commit(self):
        self.git("add", "-A")
        self.git("commit", "-q", "-m", "tests: a state")

    def plan(self, tier="landing"):
        subprocess.run(["cmake", "--preset", "release"], cwd=self.root, check=True, capture_output=True)
        done = subprocess.run(["tools/plan", "choose", "release", tier], cwd=self.root, check=True, capture_output=True, text=True)
        left = (self.root / "out" / "plan" / "release" / "leave").read_text(encoding="utf-8")
        tests = ("light", "dark", "script", "always")
        return {name for name in tests if not re.fullmatch(left, name)}, done.stdout

    def targets(self):
        return set((self.root / "out" / "plan" / "release" / "targets").read_text(encoding="utf-8").split())


class PlanTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.project = Project(folder.name)

    def expect(self, changed, tests, **files):
        self.project.write(changed)
        self.project.commit()
        chosen, said = self.project.plan()
        self.assertEqual(chosen, {"always", *tests}, said)
        return said

    def test_nothing_changed_adds_nothing(self):
        self.expect({"README.md": "another\n"}, set())
        self.assertEqual(self.project.targets(), {"test_always"})

    def test_a_source_of_a_library_adds_the_tests_about_it(self):
        said = self.expect({"dark/dark.cpp": FILES["dark/dark.cpp"] + "int more;\n"}, {"dark"})
        self.assertIn("dark: dark/dark.cpp", said)
        self.assertIn("1 minutes of a processor", said)
        self.assertIn("2 commits back", said)
        self.assertEqual(self.project.targets(), {"test_always", "test_dark"})

    def test_a_header_adds_all_that_read_it(self):
        self.expect({"include/dark.hpp": "int dark();\nint more();\n"}, {"dark", "script"})

    def test_a_comment_adds_nothing(self):
        changed = "// A story.\n\n" + FILES["dark/dark.cpp"] + "/* two\nlines */\n"
        self.expect({"dark/dark.cpp": changed, "include/dark.hpp": "int dark(); // what it does\n"}, set())

    def test_comments_end_where_quotes_begin(self):
        code = """auto a = "http://x"; auto b = R"(// /*)"; int c = 1'000'000; char d = '"', e = '/';\n"""
        self.assertEqual(build_graph.without_comments(code + "\n// gone\n"), code.rstrip("\n"))

    def test_a_source_of_a_command_adds_the_script_that_starts_it(self):
        self.expect({"command.cpp": FILES["command.cpp"] + "int more;\n"}, {"script"})

    def test_a_file_that_a_script_reads_adds_it(self):
        self.expect({"scripts/lib.sh": "false || true\n"}, {"script"})

    def test_a_script_that_is_gone_adds_those_of_its_folder(self):
        self.project.git("rm", "-q", "scripts/lib.sh")
        self.expect({"scripts/run": FILES["scripts/run"]}, {"script"})

    def test_a_compiler_option_adds_what_it_compiles(self):
        changed = FILES["CMakeLists.txt"].replace("add_executable(test_always", "target_compile_definitions(test_light PRIVATE X=1)\nadd_executable(test_always")
        self.expect({"CMakeLists.txt": changed}, {"light"})

    def test_a_new_test_is_added(self):
        changed = FILES["CMakeLists.txt"].replace("foreach(name light dark)", "foreach(name light dark)\n  add_test(NAME more_${name} COMMAND command)\n  set_tests_properties(more_${name} PROPERTIES LABELS full)")
        self.project.write({"CMakeLists.txt": changed})
        self.project.plan()
        left = (self.project.root / "out" / "plan" / "release" / "leave").read_text(encoding="utf-8")
        self.assertFalse(re.fullmatch(left, "more_light"))

    def test_a_change_that_is_not_committed_counts(self):
        self.project.write({"tests/light_test.cpp": FILES["tests/light_test.cpp"] + "int more;\n"})
        self.assertEqual(self.project.plan()[0], {"always", "light"})

    def test_a_test_that_was_not_proven_is_added(self):
        proven = (self.project.root / ".ci" / "proven").read_text(encoding="utf-8").replace("release script 1.0\n", "")
        self.expect({".ci/proven": proven, "README.md": "another\n"}, {"script"})

    def test_without_a_proven_commit_everything_runs(self):
        proven = (self.project.root / ".ci" / "proven").read_text(encoding="utf-8")
        said = self.expect({".ci/proven": re.sub("commit .*", "commit " + "0" * 40, proven)}, {"light", "dark", "script"})
        self.assertIn("no ancestor", said)
        (self.project.root / ".ci" / "proven").unlink()
        self.assertEqual(self.project.plan()[0], {"always", "light", "dark", "script"})

    def test_a_full_run_goes_on_with_what_has_not_passed(self):
        chosen, _ = self.project.plan("full")
        self.assertEqual(chosen, {"always", "light", "dark", "script"})
        line = " 1/4 Test #{}: {} ....................   {}    1.25 sec\n"
        log = self.project.root / "out" / "plan" / "release" / "ctest.log"
        log.write_text(line.format(1, "light", "Passed") + line.format(2, "script", "***Failed  ") + line.format(3, "always", "Passed"), encoding="utf-8")
        # The run was interrupted before dark ended.
        self.assertEqual(self.project.plan("full")[0], {"dark", "script"})
        log.write_text(line.format(1, "dark", "Passed"), encoding="utf-8")
        self.assertEqual(self.project.plan("full")[0], {"script"})
        # What a program links counts here: light is in dark's program.
        self.project.write({"light/light.cpp": FILES["light/light.cpp"] + "int more;\n"})
        self.assertEqual(self.project.plan("full")[0], {"light", "dark", "script"})


class TablesTest(unittest.TestCase):
    """The tables of CONTRIBUTING.md against the labels of the builds."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.sanitized = folder.name
        subprocess.run(["cmake", "--preset", "asan-ubsan", "-B", folder.name], cwd=ROOT, check=True, capture_output=True)

    def named(self, title):
        text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
        rows = text[text.index(title) :].split("\n\n")[1]
        return set(re.findall(r"`([\w.]+)`", rows))

    def labelled(self, build):
        tests = list(build_graph.read_tests(build))
        return {re.sub(r"^(test_cli)\.\d$", r"\1", test.name) for test in tests if "full" in test.labels}

    def test_release(self):
        self.assertEqual(self.named("Added to a landing in the release build"), self.labelled(RELEASE))

    def test_sanitized(self):
        self.assertEqual(self.named("Added to a landing in the sanitized build"), self.labelled(self.sanitized))

    def test_each_module_is_the_subject_of_a_test(self):
        about = {
            label
            for build in (RELEASE, self.sanitized)
            for test in build_graph.read_tests(build)
            for label in test.labels
            if label.startswith("about:")
        }
        modules = {f"about:host/src/{path.name}" for path in (ROOT / "host" / "src").iterdir() if path.is_dir()}
        self.assertEqual(modules - about, set())


if __name__ == "__main__":
    unittest.main()
