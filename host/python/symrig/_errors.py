# SPDX-License-Identifier: Apache-2.0
"""The exceptions of symrig. Each carries the code, the cause and the next step of the library's error."""

from typing import Any, Dict, Optional


class Error(Exception):
    """An error of a user or a rig.

    Attributes:
        code: number of docs/errors.md, 100 to 499. It never changes its meaning.
        name: name of the code, such as "size_mismatch".
        cause: the thing and what is wrong with it, one line.
        next_step: what to do; may be empty.
        receipt: of a program that has run and failed (Board.run()); else None.
    """

    receipt: Optional[Dict[str, Any]] = None

    def __init__(self, cause: str, next_step: str = "", code: int = 100, name: str = "bad_argument") -> None:
        super().__init__(cause, next_step, code, name)
        self.cause, self.next_step, self.code, self.name = cause, next_step, code, name

    def __str__(self) -> str:
        return f"{self.cause}; {self.next_step}" if self.next_step else self.cause


class UsageError(Error, ValueError):
    """An argument is wrong (codes 100 to 199, exit code 2 of the command)."""


class DeviceError(Error):
    """A board, camera or projector does not answer or refuses (codes 200 to 299, exit code 3)."""


class InputError(Error, ValueError):
    """A file or a value is missing or wrong (codes 300 to 399, exit code 4)."""


class LimitError(Error, RuntimeError):
    """A limit, a fault of the board, or a job that was stopped (codes 400 to 499, exit code 5)."""


class Interrupted(LimitError):
    """The progress callback has stopped the job (code 402). Ctrl-C raises KeyboardInterrupt instead."""


INTERRUPTED = 402
_CLASSES = {1: UsageError, 2: DeviceError, 3: InputError, 4: LimitError}


def error_of(code: int, name: str, cause: str, next_step: str) -> Error:
    """The exception for an error of the library."""
    kind = Interrupted if code == INTERRUPTED else _CLASSES.get(code // 100, Error)
    return kind(cause, next_step, code, name)
