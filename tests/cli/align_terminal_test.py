# SPDX-License-Identifier: Apache-2.0
"""The page of `symrig align` on a terminal: rewritten in place, with keys, and the terminal as before afterwards.

usage: align_terminal_test.py SYMRIG
"""

import fcntl
import os
import pty
import struct
import sys
import termios

PAGE = "\x1b[H\x1b[J"
# Never good enough: the camera has too few pixels.
RIG = "sim:vgroove-textured?size=24x24&fine=2&camera=40x40&turn=2&zoom=0.8&parallax=1"


def read_some(terminal):
    """What was written; nothing when the command has ended."""
    try:
        return os.read(terminal, 65536).decode(errors="replace")
    except OSError:
        return ""


def pages_with_keys(symrig, keys):
    """The pages that were shown, with a key pressed after every third one, and the exit code."""
    child, terminal = pty.fork()
    if child == 0:
        os.execv(symrig, [symrig, "align", "--rig", RIG])
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 40, 100, 0, 0))
    before = termios.tcgetattr(terminal)
    text, left = "", list(keys)
    # Reading after the end gives the rest of what was written, so the settings are asked while it still runs.
    while more := read_some(terminal):
        text += more
        if left and text.count(PAGE) >= 3 * (len(keys) - len(left) + 1):
            during = termios.tcgetattr(terminal)
            os.write(terminal, left.pop(0).encode())
    _, status = os.waitpid(child, 0)
    os.close(terminal)
    assert before[3] & termios.ECHO, "the terminal echoes at first"
    assert not during[3] & termios.ECHO, "a key must not be echoed into the page"
    return text.split(PAGE), os.waitstatus_to_exitcode(status)


def main():
    symrig = os.path.abspath(sys.argv[1])
    pages, code = pages_with_keys(symrig, "rrq")
    assert code == 0, code
    assert pages[0] == "", pages[0]
    shown = pages[1:]
    for page in shown:
        assert page.startswith("symrig align sim:vgroove-textured"), page
        assert "pixels a cell" in page and "not yet" in page, page
        assert "zoom in" in page, page
        assert "\x1b" not in page, repr(page)
    drawn = ["the longest is" in page for page in shown]
    # r draws, r again takes it away, q ends.
    assert not drawn[0] and any(drawn) and not drawn[-1], drawn
    assert any(arrow in "".join(shown) for arrow in "→←⇒⇐"), "parallax along the columns"
    print(f"{len(shown)} pages, {sum(drawn)} with a picture")


if __name__ == "__main__":
    main()
