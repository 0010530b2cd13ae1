# SPDX-License-Identifier: Apache-2.0
"""tools/test ends as failed when a stage did not finish: what a later stage would test is what was built before.

A copy of the script runs in an empty tree, with programs on its PATH that only note that they were called.
"""

import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

TOOLS = pathlib.Path(__file__).resolve().parents[2] / "tools"


def case(name, status, printed=""):
    """A test in ctest's JUnit file."""
    return f'<testcase name="{name}" classname="{name}" time="1" status="{status}">\n<system-out>{printed}</system-out>\n</testcase>\n'


def report(*cases):
    return "<testsuite>\n" + "".join(cases) + "</testsuite>"


# A program of GoogleTest counts its cases. A job of the bench counts as one, although it prints the same lines.
PASSED = "Running main()\n[==========] 6 tests from 2 test suites ran. (1 ms total)\n[  PASSED  ] 5 tests.\n[  SKIPPED ] 1 test.\n"
FAILED = "[==========] 6 tests from 2 test suites ran. (1 ms total)\n[  PASSED  ] 4 tests.\n[  FAILED  ] 2 tests, listed below:\n"
GOOD_REPORT = report(case("test_tensor", "run", PASSED), case("bench.projector", "run", PASSED), case("checks.words", "run"))
FAILED_REPORT = report(
    case("test_tensor", "fail", FAILED), case("test_that_crashed", "fail", "Segmentation fault\n"),
    case("bench.no_such_machine", "notrun"), case("checks.words", "run"),
)  # fmt: skip
FAILED_JOB = report(case("bench.prepare", "run"), case("bench.projector", "fail", FAILED), case("checks.words", "run"))
# ctest also runs again what prepares the bench.
PASSED_JOB = report(case("bench.prepare", "run"), case("bench.projector", "run", PASSED))
UNPREPARED = report(case("bench.prepare", "fail"), case("bench.projector", "notrun"), case("checks.words", "run"))


class Tree:
    """A tree with tools/test and stand-ins for all that it calls."""

    def __init__(self, folder):
        self.root = pathlib.Path(folder)
        self.bin = self.root / "bin"
        self.bin.mkdir()
        (self.root / "tools").mkdir()
        for name in ("test", "lib.sh"):
            shutil.copy(TOOLS / name, self.root / "tools" / name)
        for name in ("setup", "firmware", "check-tidy", "tbb"):
            self.program(self.root / "tools" / name, name)
        plan = """[ "$1" != prove ] || echo prove >>called
        [ "$1" != choose ] || { mkdir -p "out/plan/$2" && echo '^$' >"out/plan/$2/leave" && : >"out/plan/$2/targets"; }"""
        self.program(self.root / "tools" / "plan", "plan", plan)
        self.program(self.bin / "cmake", "cmake", 'mkdir -p build/release build/asan-ubsan build/tsan')
        fuzz = self.root / "build" / "fuzz" / "tests" / "fuzz"
        seeds = self.root / "tests" / "fuzz" / "make_seeds.py"
        for folder in (fuzz, seeds.parent):
            folder.mkdir(parents=True)
        self.program(fuzz / "fuzz_frame", "fuzz_frame")
        self.program(seeds, "make_seeds.py", "echo fuzz_frame")
        self.program(self.bin / "ninja", "ninja")
        self.ctest(GOOD_REPORT, 0)

    def program(self, path, name, body="", code=0):
        path.write_text(f"#!/bin/bash\necho {name} >>{self.root}/called\n{body}\nexit {code}\n", encoding="utf-8")
        path.chmod(0o755)

    def ctest(self, report, code):
        body = f"""while [ $# -gt 0 ]; do [ "$1" != --output-junit ] || echo '{report}' >"$2"; shift; done"""
        self.program(self.bin / "ctest", "ctest", body, code)

    def ctest_again(self, first, second, code):
        """ctest that gives the second report when it is called with -R."""
        (self.root / "first").write_text(first, encoding="utf-8")
        (self.root / "second").write_text(second, encoding="utf-8")
        body = f"""report=first code=8
        echo "$*" >>{self.root}/arguments
        while [ $# -gt 0 ]; do
          [ "$1" != -R ] || report=second code={code}
          [ "$1" != --output-junit ] || to=$2
          shift
        done
        cp {self.root}/$report "$to"
        exit $code"""
        self.program(self.bin / "ctest", "ctest", body)

    def run(self, *options):
        environment = {**os.environ, "PATH": f"{self.bin}:{os.environ['PATH']}"}
        done = subprocess.run(
            [self.root / "tools" / "test", *options], env=environment, capture_output=True, text=True, check=False
        )
        called = (self.root / "called").read_text(encoding="utf-8").split()
        return done.returncode, called, done.stdout.splitlines()[-1]


class StagesTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.tree = Tree(folder.name)

    def test_all_stages_run_and_are_counted(self):
        code, called, last = self.tree.run()
        self.assertEqual(code, 0)
        self.assertEqual(called.count("ctest"), 2)
        self.assertIn("check-tidy", called)
        for only_full in ("fuzz_frame", "prove"):
            self.assertNotIn(only_full, called)
        self.assertEqual(last, "16 passed, 0 failed, 2 skipped")

    def test_a_full_run_adds_its_parts_and_proves(self):
        code, called, last = self.tree.run("--full")
        self.assertEqual(code, 0)
        self.assertEqual(called.count("ctest"), 3)
        for part in ("check-tidy", "fuzz_frame", "prove"):
            self.assertEqual(called.count(part), 1, part)
        self.assertEqual(last, "24 passed, 0 failed, 3 skipped")

    def test_a_full_run_with_a_failure_proves_nothing(self):
        self.tree.ctest(FAILED_REPORT, 8)
        code, called, last = self.tree.run("--full")
        self.assertEqual(code, 1)
        self.assertNotIn("prove", called)
        self.assertIn("fuzz_frame", called)
        self.assertEqual(last, "18 passed, 9 failed, 3 skipped")

    def test_findings_of_clang_tidy_end_a_full_run_before_its_tests(self):
        self.tree.program(self.tree.root / "tools" / "check-tidy", "check-tidy", code=1)
        code, called, last = self.tree.run("--full")
        self.assertEqual(code, 1)
        self.assertNotIn("ctest", called)
        self.assertEqual(last, "1 passed, 1 failed, 0 skipped")

    def test_what_is_asked_for_by_name_runs_alone(self):
        code, called, last = self.tree.run("--filter", "words")
        self.assertEqual(code, 0)
        self.assertNotIn("check-tidy", called)
        self.assertEqual(last, "15 passed, 0 failed, 2 skipped")

    def test_tests_that_fail_do_not_hide_the_stages_after_them(self):
        self.tree.ctest(FAILED_REPORT, 8)
        code, called, last = self.tree.run()
        self.assertEqual(code, 1)
        self.assertEqual(called.count("ctest"), 2)
        self.assertEqual(last, "12 passed, 6 failed, 2 skipped")

    def test_a_job_that_passes_alone_has_passed(self):
        self.tree.ctest_again(FAILED_JOB, PASSED_JOB, 0)
        code, called, last = self.tree.run()
        self.assertEqual(code, 0)
        self.assertEqual(called.count("ctest"), 4)
        self.assertEqual(last, "8 passed, 0 failed, 0 skipped")

    def test_a_job_that_fails_twice_has_failed_once(self):
        self.tree.ctest_again(FAILED_JOB, FAILED_JOB, 8)
        code, _, last = self.tree.run()
        self.assertEqual(code, 1)
        self.assertEqual(last, "6 passed, 2 failed, 0 skipped")

    def test_a_job_that_was_not_run_again_has_failed(self):
        self.tree.ctest_again(FAILED_JOB, "", 0)
        code, _, last = self.tree.run()
        self.assertEqual(code, 1)
        self.assertEqual(last, "6 passed, 2 failed, 0 skipped")

    def test_a_bench_that_was_not_prepared_runs_all_its_jobs_again(self):
        self.tree.ctest_again(UNPREPARED, PASSED_JOB, 0)
        code, _, last = self.tree.run()
        self.assertEqual(code, 0)
        self.assertEqual(last, "8 passed, 0 failed, 0 skipped")
        arguments = (self.tree.root / "arguments").read_text(encoding="utf-8").splitlines()
        self.assertEqual([line.split()[3] for line in arguments if " -R " in line], [r"^bench\."] * 2)

    def test_an_interrupted_build_ends_the_run(self):
        self.tree.program(self.tree.bin / "ninja", "ninja", code=130)
        code, called, last = self.tree.run()
        self.assertEqual(code, 1)
        self.assertNotIn("ctest", called)
        self.assertNotIn("check-tidy", called)
        self.assertIn("1 failed", last)

    def test_interrupted_tests_end_the_run(self):
        self.tree.ctest(GOOD_REPORT, 130)
        code, called, last = self.tree.run()
        self.assertEqual(code, 1)
        self.assertEqual(called.count("ctest"), 1)
        self.assertIn("1 failed", last)

    def test_a_configuration_that_failed_ends_the_run(self):
        self.tree.program(self.tree.bin / "cmake", "cmake", code=1)
        code, called, last = self.tree.run()
        self.assertEqual(code, 1)
        self.assertNotIn("ninja", called)
        self.assertIn("1 failed", last)

    def test_firmware_that_was_not_built_ends_the_run(self):
        self.tree.program(self.tree.root / "tools" / "firmware", "firmware", code=1)
        code, called, last = self.tree.run()
        self.assertEqual(code, 1)
        self.assertNotIn("cmake", called)
        self.assertIn("1 failed", last)


if __name__ == "__main__":
    unittest.main()
