# SPDX-License-Identifier: Apache-2.0
"""tools/check-words on small pages: it must find a long sentence, and count nothing that is not prose."""

import pathlib
import subprocess
import sys
import tempfile
import unittest

CHECK = pathlib.Path(__file__).resolve().parents[2] / "tools" / "check-words"
SHORT = "A rig has one board. "
LONG = " ".join(["word"] * 26) + ". "


def check(text, *options):
    """Exit code and printed lines, without the name of the page."""
    with tempfile.TemporaryDirectory() as folder:
        page = pathlib.Path(folder) / "page.md"
        page.write_text(text, encoding="utf-8")
        done = subprocess.run([sys.executable, "-B", CHECK, *options, page], capture_output=True, text=True, check=False)
        return done.returncode, done.stdout.replace(f"{page}:", "").strip().splitlines()


class Words(unittest.TestCase):
    def counted(self, text):
        return int(check(text)[1][0].split()[0])

    def test_a_page_of_short_sentences_passes(self):
        code, printed = check(SHORT * 20)
        self.assertEqual(code, 0)
        self.assertEqual(printed[0].strip(), "20 sentences, median 5 words, 0.0 % over 25")

    def test_a_planted_long_sentence_is_found_with_its_line(self):
        code, printed = check("# Page\n\n" + SHORT * 10 + "\n\n" + LONG, "--long")
        self.assertEqual(code, 1)
        self.assertIn("9.1 % over 25: too long", printed[0])
        self.assertTrue(printed[1].startswith("5: 26 words: word word"), printed[1])

    def test_one_long_sentence_in_twenty_passes(self):
        self.assertEqual(check(SHORT * 19 + LONG)[0], 0)
        self.assertEqual(check(SHORT * 18 + LONG)[0], 1)

    def test_a_median_over_15_words_is_found(self):
        sixteen = " ".join(["word"] * 16) + ". "
        self.assertEqual(check(sixteen * 5)[0], 1)
        self.assertEqual(check(sixteen * 5 + SHORT * 6)[0], 0)

    def test_what_is_not_prose_is_left_out(self):
        for text in (f"```sh\n{LONG}\n```", f"| {LONG} |", f"# {LONG}", f"<!-- {LONG} -->", f"    {LONG}", f"![{LONG}](a.png)"):
            with self.subTest(text[:8]):
                self.assertEqual(self.counted(SHORT + "\n\n" + text + "\n\n" + SHORT), 2)

    def test_prose_after_a_code_block_is_counted_again(self):
        self.assertEqual(check(f"```sh\nx\n```\n{LONG}")[0], 1)

    def test_inline_code_is_one_word(self):
        self.assertIn("median 3 words", check(f"Say `{LONG}` twice.")[1][0])

    def test_list_items_end_sentences(self):
        self.assertEqual(self.counted("- one two\n- three\n  four\n1. five\n\nsix\n"), 4)

    def test_a_sentence_goes_on_over_lines_and_short_forms(self):
        self.assertEqual(self.counted("See Fig. 8, e.g. here\nand there. The end!"), 2)

    def test_a_word_that_is_no_option_is_refused(self):
        self.assertEqual(check(SHORT, "--lang")[0], 2)


if __name__ == "__main__":
    unittest.main()
