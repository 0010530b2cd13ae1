# SPDX-License-Identifier: Apache-2.0
"""The files that the checks read: all that git tracks or would track. Without git (a source archive): all but build folders."""

import pathlib
import subprocess

ROOT = pathlib.Path(__file__).resolve().parent.parent
NOT_OURS = {".git", ".deps", "build", "out", "node_modules", "__pycache__"}


def files(root=ROOT):
    """Paths relative to root, sorted."""
    listed = subprocess.run(
        ["git", "-C", str(root), "ls-files", "-z", "-co", "--exclude-standard"], capture_output=True, check=False
    )
    if listed.returncode == 0 and listed.stdout:
        names = [pathlib.Path(name) for name in listed.stdout.decode().split("\0") if name]
        return sorted(name for name in names if (root / name).is_file())
    found = (path.relative_to(root) for path in root.rglob("*") if path.is_file())
    return sorted(name for name in found if not NOT_OURS & set(name.parts))
