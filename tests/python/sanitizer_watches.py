# SPDX-License-Identifier: Apache-2.0
"""Builds with AddressSanitizer only: it watches the module, and memory of Python."""

import subprocess
import sys

import symrig


def test_the_module_is_instrumented():
    names = subprocess.run(["nm", "-D", symrig._symrig.__file__], capture_output=True, text=True, check=True).stdout
    assert "__asan_report_store" in names and "__ubsan_handle" in names


def test_an_array_that_is_gone_is_reported():
    script = (
        "import ctypes, numpy\n"
        "array = numpy.ones(1000, numpy.float32)\n"
        "place = array.ctypes.data\n"
        "del array\n"
        "ctypes.memset(place, 0, 4)\n"
        "print('not seen')\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.returncode != 0 and "heap-use-after-free" in done.stderr and not done.stdout, done
