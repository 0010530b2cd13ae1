# SPDX-License-Identifier: Apache-2.0
"""Slow motion: the clocks of QEMU and its helper processes run K times slower. So a second of the guest has K seconds of computing time.

libfaketime (https://github.com/wolfcw/libfaketime) does it, for every process that has its environment; their rates are the same.
"""

import glob
import os

from host.assets import cannot

# The processor's own counter is not slowed. A guest that measures its rate against a slowed clock is wrong by about 100 ppm.
KERNEL_ARGUMENTS = ("clocksource=hpet", "tsc=unstable")


def environment(slow):
    """The environment of a process in slow motion. Unchanged for 1."""
    if slow == 1:
        return None
    library = glob.glob("/usr/lib/*-linux-gnu/faketime/libfaketimeMT.so.1")
    if not library:
        cannot("slow motion needs libfaketime; tools/setup test installs it")
    return os.environ | {"LD_PRELOAD": library[0], "FAKETIME": f"+0 x{1 / slow:.9f}", "NO_FAKE_STAT": "1"}
