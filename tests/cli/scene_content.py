# SPDX-License-Identifier: Apache-2.0
"""What a scene.h5 holds, to be compared bit for bit. Ends the test as skipped where h5py is not installed."""

import sys

try:
    import h5py
except ImportError as missing:
    print(f"skipped: {missing}; install python3-h5py")
    sys.exit(77)


def content(path):
    """Every dataset as bytes and every attribute, but the JSON with its times."""
    found = {}

    def note(name, thing):
        found.update({f"{name}@{key}": str(value) for key, value in thing.attrs.items() if key != "capture"})
        if isinstance(thing, h5py.Dataset):
            found[name] = (thing.shape, str(thing.dtype), thing[()].tobytes())

    with h5py.File(path, "r") as file:
        note("", file)
        file.visititems(note)
    return found
