# SPDX-License-Identifier: Apache-2.0
"""tools/check-layers on small trees with one planted fault each: it must name the file and the line, and nothing else."""

import pathlib
import subprocess
import sys
import tempfile
import unittest

CHECK = pathlib.Path(__file__).resolve().parents[2] / "tools" / "check-layers"
# A tree whose arrows all point the right way.
GOOD = {
    "host/include/symrig/base/result.hpp": "",
    "host/include/symrig/tensor/tensor.hpp": '#include "symrig/base/result.hpp"\n',
    "host/include/symrig/report/page.hpp": '#include "symrig/tensor/tensor.hpp"\n',
    "host/src/base/CMakeLists.txt": "symrig_module(base PACKAGES fmt::fmt)\n",
    "host/src/tensor/CMakeLists.txt": "# The tensor.\nsymrig_module(tensor LINKS base\n  PACKAGES fmt::fmt)\n",
    "host/src/board/CMakeLists.txt": "symrig_module(board LINKS base protocol board_sim)\n",
    "host/src/report/CMakeLists.txt": "symrig_module(report LINKS tensor)\n",
    "host/src/tensor/kernel.hpp": "#include <vector>\n",
    "host/src/tensor/tensor.cpp": '#include "tensor/kernel.hpp"\n',
    "host/src/board/link.cpp": '#include "symrig/boards/sim_board.hpp"\n#include "symrig.pb.h"\n',
    "host/include/symrig/testing/laws.hpp": '#include "symrig/report/page.hpp"\n#include <gtest/gtest.h>\n',
    "host/apps/main.cpp": '#include "symrig/report/page.hpp"\n',
    "host/apps/console.hpp": "",
    "host/mpi/ranks.hpp": "#include <vector>\n",
    "host/mpi/main.cpp": '#include "console.hpp"\n#include "ranks.hpp"\n#include "symrig/report/page.hpp"\n',
    "protocol/include/symrig/protocol/frame.hpp": "#include <cstdint>\n",
    "hal/include/symrig/hal/lines.hpp": "#include <cstdint>\n",
    "firmware/version.hpp.in": "",
    "firmware/src/hello.cpp": '#include "symrig/firmware/version.hpp"\n',
    "firmware/include/symrig/firmware/core.hpp": '#include "symrig/hal/lines.hpp"\n#include "symrig/protocol/frame.hpp"\n',
    "boards/common/include/symrig/boards/playback.hpp": '#include "symrig/hal/lines.hpp"\n#include <vector>\n',
    "boards/common/src/playback.cpp": '#include "symrig/boards/playback.hpp"\n#include "symrig/firmware/core.hpp"\n',
    "boards/linux/src/player.cpp": '#include "symrig/boards/playback.hpp"\n#include "symrig/base/result.hpp"\n',
    "boards/sim/include/symrig/boards/sim_board.hpp": '#include "symrig/firmware/core.hpp"\n#include <vector>\n',
    "boards/sim/src/engine.hpp": '#include "symrig/boards/playback.hpp"\n',
}
# file → content, the line at fault, a word of the message.
FAULTS = {
    "host/src/base/low.cpp": ("\n#include <vector>\n#include \"symrig/tensor/tensor.hpp\"\n", 3, "host tensor"),
    "host/src/tensor/up.cpp": ('#include "symrig/report/page.hpp"\n', 1, "host report"),
    "host/src/tensor/board.cpp": ('#include "symrig/boards/sim_board.hpp"\n', 1, "boards sim"),
    "host/src/report/laws.cpp": ('#include "symrig/testing/laws.hpp"\n', 1, "testing"),
    "host/apps/laws.cpp": ('#include "symrig/testing/laws.hpp"\n', 1, "testing"),
    "host/include/symrig/testing/wire.hpp": ('#include "symrig/protocol/frame.hpp"\n', 1, "protocol"),
    "host/src/board/core.cpp": ('#include "symrig/firmware/core.hpp"\n', 1, "firmware"),
    "host/src/tensor/near.cpp": ('#include "kernel.hpp"\n', 1, "tensor/kernel.hpp"),
    "host/src/report/CMakeLists.txt": ("symrig_module(report LINKS tensor report)\n", 1, "circle"),
    "host/src/novel/new.cpp": ("", 1, "no layer"),
    "host/apps/ranks.cpp": ('#include "ranks.hpp"\n', 1, "mpi"),
    "host/src/report/ranks.cpp": ('#include "ranks.hpp"\n', 1, "mpi"),
    "host/mpi/low.cpp": ('#include "symrig/hal/lines.hpp"\n', 1, "hal"),
    "host/apps/low.cpp": ('#include "symrig/hal/lines.hpp"\n', 1, "hal"),
    "firmware/src/host.cpp": ('#include "symrig/base/result.hpp"\n', 1, "host base"),
    "firmware/src/board.cpp": ('#include "symrig/boards/sim_board.hpp"\n', 1, "boards sim"),
    "firmware/src/heap.cpp": ("#include <vector>\n", 1, "allocate"),
    "firmware/src/typo.cpp": ('#include "symrig/hal/line.hpp"\n', 1, "not in the tree"),
    "firmware/src/common.cpp": ('#include "symrig/boards/playback.hpp"\n', 1, "boards common"),
    "boards/common/src/board.cpp": ('#include "symrig/boards/sim_board.hpp"\n', 1, "boards sim"),
    "boards/common/src/host.cpp": ('#include "symrig/base/result.hpp"\n', 1, "host base"),
    "boards/linux/src/board.cpp": ('#include "symrig/boards/sim_board.hpp"\n', 1, "boards sim"),
    "host/src/board/engine.cpp": ('#include "symrig/boards/playback.hpp"\n', 1, "boards common"),
    "hal/include/symrig/hal/up.hpp": ('#include "symrig/protocol/frame.hpp"\n', 1, "protocol"),
    "protocol/src/up.cpp": ('#include "symrig/firmware/core.hpp"\n', 1, "firmware"),
}  # fmt: skip


def check(tree):
    with tempfile.TemporaryDirectory() as folder:
        for name, text in tree.items():
            path = pathlib.Path(folder) / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        done = subprocess.run([sys.executable, "-B", CHECK, folder], capture_output=True, text=True, check=False)
        return done.returncode, done.stdout.strip().splitlines()


class Layers(unittest.TestCase):
    def test_right_arrows_pass(self):
        self.assertEqual(check(GOOD), (0, ["check-layers: 0 findings"]))

    def test_an_empty_tree_is_not_a_pass(self):
        self.assertEqual(check({})[0], 1)

    def test_each_wrong_arrow_is_named(self):
        for name, (text, line, word) in FAULTS.items():
            with self.subTest(name):
                code, printed = check({**GOOD, name: text})
                self.assertEqual(code, 1)
                self.assertEqual(len(printed), 2, printed)
                self.assertTrue(printed[0].startswith(f"{name}:{line}: "), printed[0])
                self.assertIn(word, printed[0])


if __name__ == "__main__":
    unittest.main()
