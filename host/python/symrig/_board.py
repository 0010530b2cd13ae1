# SPDX-License-Identifier: Apache-2.0
"""Timed programs on trigger boards, and their receipts."""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Any, Dict, List, Optional, Union

from . import _symrig
from ._errors import Error, error_of

if TYPE_CHECKING:
    from ._capture import ProgressCallback


class Program:
    """A program file in TOML (docs/program-file.md), or a compiled one (`symrig compile`).

    Raises:
        InputError: there is no such file, or it is no program.
    """

    def __init__(self, path: Union[str, "os.PathLike[str]"]) -> None:
        self.path = os.fspath(path)
        self._program = _symrig.Program(self.path)

    def __repr__(self) -> str:
        return f"<symrig.Program: {self.path}>"


class Board:
    """A connection to a trigger board. It closes at the end of a `with` block.

    Args:
        uri: "usb:", "serial:/dev/ttyACM0", "tcp:HOST:PORT", ...; "sim:" is a board in virtual time.
        program: the program that it will run. It gives the keep-alive, and the wiring of a simulated board.
    """

    def __init__(self, uri: str, program: Optional[Program] = None) -> None:
        self.uri = uri
        self._board = _symrig.Board(uri, program._program if program else None)

    @property
    def info(self) -> Dict[str, Any]:
        """Identity and abilities of the board."""
        info: Dict[str, Any] = json.loads(self._board.info())
        return info

    def lint(self, program: Program) -> List[Dict[str, Any]]:
        """Findings for a program on this board: "line", "severity", "rule", "what", "alternative"."""
        findings: List[Dict[str, Any]] = json.loads(self._board.lint(program._program))["findings"]
        return findings

    def run(self, program: Program, *, progress: Optional["ProgressCallback"] = None) -> Dict[str, Any]:
        """Runs a program to its end, and keeps the board alive meanwhile.

        Args:
            progress: called with a Progress several times a second; False aborts the run.

        Returns:
            The receipt (docs/receipt.md): what was planned, and what the board has measured.

        Raises:
            Error: the program has errors, or the run failed. Its attribute `receipt` is the receipt if there is one. So it
                is with KeyboardInterrupt, and with what `progress` raises.
        """
        try:
            receipt, code, cause, next_step = self._board.run(program._program, progress)
        except Error:
            raise
        except BaseException as stop:
            text = self._board.last_receipt()
            setattr(stop, "receipt", json.loads(text) if text else None)
            raise
        found: Optional[Dict[str, Any]] = json.loads(receipt) if receipt else None
        if code == 0 and found is not None:
            return found
        failure = error_of(code, _symrig.error_name(code), cause, next_step)
        failure.receipt = found
        raise failure

    def abort(self) -> None:
        """Sets the outputs to their safe levels at once. Any thread may call it."""
        self._board.abort()

    def clear_fault(self) -> None:
        """Clears a fault that an earlier run has latched."""
        self._board.clear_fault()

    def close(self) -> None:
        """Aborts a run in progress, and disconnects."""
        self._board.close()

    def __enter__(self) -> "Board":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
