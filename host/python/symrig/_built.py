# SPDX-License-Identifier: Apache-2.0
"""Why the compiled part of symrig cannot be loaded, in words that name the next step."""

import importlib.machinery
import importlib.util
import pathlib
import platform


def check_built() -> None:
    """Raises ImportError if the module _symrig is missing, or was built for another Python. Python alone would call that a
    circular import."""
    if importlib.util.find_spec("symrig._symrig") is not None:
        return
    here = pathlib.Path(__file__).parent
    found = sorted(path.name for path in here.glob("_symrig.*.so"))
    this = f"{platform.python_implementation()} {platform.python_version()}"
    if not found:
        raise ImportError(
            f"symrig in {here} is not built; run `cmake --preset release && ninja -C build/release`, and set PYTHONPATH to"
            " build/release/host/python (docs/python.md)",
            name="symrig",
        )
    raise ImportError(
        f"symrig in {here} was built for another Python: it has {', '.join(found)}, and {this} needs"
        f" _symrig{importlib.machinery.EXTENSION_SUFFIXES[0]}; run that Python, or build symrig for this one"
        " (docs/python.md)",
        name="symrig",
    )


check_built()
