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


def complete_pages(text):
    return text.split(PAGE)[1:-1]


def pages_with_keys(symrig, keys):
    """The pages that were shown, and the exit code. keys: (key, whether the pages so far call for it)."""
    child, terminal = pty.fork()
    if child == 0:
        os.execv(symrig, [symrig, "align", "--rig", RIG])
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 40, 100, 0, 0))
    before = termios.tcgetattr(terminal)
    text, left = "", list(keys)
    # Reading after the end gives the rest of what was written, so the settings are asked while it still runs.
    while more := read_some(terminal):
        text += more
        if left and left[0][1](complete_pages(text)):
            during = termios.tcgetattr(terminal)
            os.write(terminal, left.pop(0)[0].encode())
    _, status = os.waitpid(child, 0)
    os.close(terminal)
    assert before[3] & termios.ECHO, "the terminal echoes at first"
    assert not during[3] & termios.ECHO, "a key must not be echoed into the page"
    return text.split(PAGE), os.waitstatus_to_exitcode(status)


def has_picture(page):
    return "the longest is" in page


def main():
    symrig = os.path.abspath(sys.argv[1])
    # r draws, r again takes it away, q ends. A key waits for what the one before did: on a busy machine two keys
    # may come between two pages.
    pages, code = pages_with_keys(symrig, [
        ("r", lambda pages: len(pages) >= 3),
        ("r", lambda pages: has_picture(pages[-1])),
        ("q", lambda pages: not has_picture(pages[-1])),
    ])
    assert code == 0, code
    assert pages[0] == "", pages[0]
    shown = pages[1:]
    for page in shown:
        assert page.startswith("symrig align sim:vgroove-textured"), page
        assert "pixels a cell" in page and "not yet" in page, page
        assert "zoom in" in page, page
        assert "\x1b" not in page, repr(page)
    drawn = [has_picture(page) for page in shown]
    assert not drawn[0] and any(drawn) and not drawn[-1], drawn
    assert any(arrow in "".join(shown) for arrow in "→←⇒⇐"), "parallax along the columns"
    print(f"{len(shown)} pages, {sum(drawn)} with a picture")


if __name__ == "__main__":
    main()
