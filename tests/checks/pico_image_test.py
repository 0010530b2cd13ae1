#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: Apache-2.0
"""The scripts behind the Pico's image: each refuses what it is there to refuse."""

import contextlib
import copy
import io
import pathlib
import struct
import sys
import tempfile
import tomllib
import unittest

PICO = pathlib.Path(__file__).resolve().parent.parent.parent / "boards" / "pico"
sys.path[:0] = [str(PICO), str(PICO.parent / "common")]

import check_flash  # noqa: E402
import check_size  # noqa: E402
import check_stack  # noqa: E402
import generate  # noqa: E402
import make_image  # noqa: E402


class Description(unittest.TestCase):
    def setUp(self):
        self.board = generate.load()

    def broken(self, change):
        board = copy.deepcopy(self.board)
        change(board["line"])
        with self.assertRaises(SystemExit) as stopped:
            generate.check(board)
        return str(stopped.exception)

    def test_outputs_must_be_the_first_pins_in_order(self):
        def swap(lines):
            lines[0]["gpio"], lines[1]["gpio"] = lines[1]["gpio"], lines[0]["gpio"]

        self.assertIn("outputs come first", self.broken(swap))

    def test_a_pin_has_one_use(self):
        self.assertIn("a pin has one use", self.broken(lambda lines: lines[-1].update(gpio=lines[-2]["gpio"])))

    def test_waits_need_a_stamp_by_pio(self):
        self.assertIn("waits need PIO", self.broken(lambda lines: lines[-1].update(waits=["rising"])))

    def test_trips_need_an_interrupt(self):
        self.assertIn("trips need", self.broken(lambda lines: lines[12].update(trips=True)))

    def test_header_and_record_tell_the_same(self):
        header, record = generate.header(self.board), generate.record(self.board)
        for line in self.board["line"]:
            self.assertIn(f'"{line["name"]}", "GPIO{line["gpio"]}"', header)
            self.assertIn(f'"name": "{line["name"]}"', record)

    def test_the_page_is_current(self):
        page = generate.PAGE.read_text(encoding="utf-8")
        self.assertEqual(page, generate.renew(page, self.board))


class Flash(unittest.TestCase):
    CODE_END = 0x20010000
    FLASH_CODE = range(0x10000000, 0x10000400)

    def function(self, address, name, branches=(), words=()):
        made = check_flash.Function(address, name)
        made.branches, made.words = list(branches), list(words)
        return made

    def problems(self, *functions):
        return check_flash.check_functions(functions, self.CODE_END, self.FLASH_CODE)

    def test_code_in_ram_may_call_code_in_ram(self):
        self.assertEqual(self.problems(self.function(0x20000100, "usb_handler", branches=[0x20000200], words=[0x50110000])), [])

    def test_a_handler_that_branches_to_flash_is_found(self):
        self.assertIn("branches to flash", self.problems(self.function(0x20000100, "usb_handler", branches=[0x10000300]))[0])

    def test_a_pointer_to_flash_code_is_found(self):
        self.assertIn("holds the flash address", self.problems(self.function(0x20000100, "gpio_handler", words=[0x10000301]))[0])

    def test_only_the_settings_read_flash_and_no_handler_does(self):
        settings = check_flash.SETTINGS.start
        self.assertEqual(self.problems(self.function(0x20000100, "_ZN6symrig4pico13PicoSettings4load", words=[settings])), [])
        self.assertEqual(len(self.problems(self.function(0x20000100, "PicoSettings_handler", words=[settings]))), 1)
        self.assertEqual(len(self.problems(self.function(0x20000100, "other", words=[settings]))), 1)

    def test_start_up_calls_nothing_that_is_not_there_yet(self):
        self.assertIn("before the copy", self.problems(self.function(0x10000200, "start_clocks", branches=[0x20000100]))[0])

    def test_functions_and_vectors_in_flash_are_found(self):
        vectors = {0x20003900 + 4 * i: 0x20000101 for i in range(48)}
        self.assertEqual(check_flash.check_places({"main": (0x20000100, "T")}, vectors, 0x20003900), [])
        self.assertIn("played is in flash", check_flash.check_places({"played": (0x10000380, "t")}, vectors, 0x20003900))
        vectors[0x20003900 + 4 * 29] = 0x10000381
        self.assertIn("vector 29", check_flash.check_places({}, vectors, 0x20003900)[0])

    def test_a_table_of_flash_pointers_is_found(self):
        found = check_flash.check_data({0x20010010: 0x10000381, 0x20010014: 0x10111018}, self.CODE_END, 0x20003900, self.FLASH_CODE)
        self.assertEqual(len(found), 1)


def flat_image(size=1000):
    flat = bytearray(range(256)) * 4
    flat[make_image.MANIFEST : make_image.MANIFEST + 56] = struct.pack("<8sIIQ16s16s", b"SYMRIGFW", 1, 0, 0x123, b"pico", b"1.2.3")
    return bytes(flat[:size])


class Image(unittest.TestCase):
    def test_crc_of_the_check_string(self):
        self.assertEqual(make_image.crc32_mpeg(b"123456789"), 0x0376E6E7)  # CRC-32/MPEG-2's published check value

    def test_boot2_gets_its_crc_and_nothing_else_changes(self):
        flat = flat_image()
        sealed = make_image.with_boot2_crc(flat)
        # A CRC over data and its CRC, highest byte first, leaves nothing; the ROM wants the lowest byte first.
        self.assertEqual(make_image.crc32_mpeg(sealed[:252] + sealed[252:256][::-1]), 0)
        self.assertEqual(sealed[:252] + sealed[256:], flat[:252] + flat[256:])

    def test_uf2_holds_the_flash_in_order(self):
        flat = flat_image()
        blocks = make_image.uf2(flat)
        self.assertEqual(len(blocks), 4 * 512)
        held = b""
        for number in range(4):
            block = blocks[512 * number : 512 * (number + 1)]
            first, second, flags, address, size, index, count, family = struct.unpack_from("<8I", block)
            self.assertEqual((first, second, flags), (0x0A324655, 0x9E5D5157, 0x2000))
            self.assertEqual((address, size, index, count), (0x10000000 + 256 * number, 256, number, 4))
            self.assertEqual((family, struct.unpack_from("<I", block, 508)[0]), (0xE48BFF56, 0x0AB16F30))
            held += block[32 : 32 + size]
        self.assertEqual(held, flat.ljust(1024, b"\0"))

    def test_manifest_is_read_or_missed(self):
        self.assertEqual(make_image.read_manifest(flat_image()), {"board": "pico", "version": "1.2.3", "firmware_hash": f"{0x123:016x}"})
        with self.assertRaises(SystemExit):
            make_image.read_manifest(bytes(1000))


class Heap(unittest.TestCase):
    def test_symbols_that_ask_for_heap(self):
        for name in ("malloc", "_malloc_r", "free", "_sbrk", "_sbrk_r", "_Znwj", "_ZdaPv", "__cxa_atexit", "abort", "_exit"):
            self.assertTrue(check_size.HEAP["pico"].match(name), name)
        for name in ("main", "__cxa_pure_virtual", "_ZN6symrig8firmware4Core5abortEv", "free_running"):
            self.assertFalse(check_size.HEAP["pico"].match(name), name)

    def test_sizes_and_heap_are_refused(self):
        limits = self.limits()
        sizes = {"flash": limits["flash_limit"], "ram": limits["ram_limit"]}
        self.assertEqual(self.verdict({"main": 1}, sizes), 0)
        self.assertEqual(self.verdict({"main": 1}, {**sizes, "flash": sizes["flash"] + 1}), 1)
        self.assertEqual(self.verdict({"main": 1}, {**sizes, "ram": sizes["ram"] + 1}), 1)
        self.assertEqual(self.verdict({"main": 1, "malloc": 2}, sizes), 1)

    @staticmethod
    def limits():
        return tomllib.loads((PICO / "board.toml").read_text(encoding="utf-8"))["resources"]

    @staticmethod
    def verdict(found, sizes):
        with contextlib.redirect_stdout(io.StringIO()):
            return check_size.check("pico", found, sizes)


class Stack(unittest.TestCase):
    def graph(self, *lines):
        graph = check_stack.Graph()
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "a.ci"
            path.write_text("\n".join(lines), encoding="utf-8")
            graph.read(path)
        graph.resolve()
        return graph

    @staticmethod
    def node(name, size, kind="static"):
        return f'node: {{ title: "{name}" label: "{name}\\n{size} bytes ({kind})\\n0 dynamic objects" }}'

    @staticmethod
    def edge(source, target):
        return f'edge: {{ sourcename: "{source}" targetname: "{target}" }}'

    def test_the_deepest_path_counts(self):
        graph = self.graph(self.node("a", 8), self.node("b", 16), self.node("c", 100), self.edge("a", "b"), self.edge("a", "c"), self.edge("b", "memcpy"))
        self.assertEqual(graph.depths()["a"][0], 108)
        self.assertEqual(graph.depths()["b"][0], 16 + check_stack.LIBRARY)
        self.assertEqual(graph.problems, [])

    def test_recursion_is_found(self):
        graph = self.graph(self.node("a", 8), self.node("b", 8), self.edge("a", "b"), self.edge("b", "a"))
        graph.depths()
        self.assertEqual([problem.split(":")[0] for problem in graph.problems], ["can call itself"])

    def test_nanopb_descends_as_often_as_messages_nest(self):
        graph = self.graph(self.node("pb_decode_inner", 100), self.node("decode_field", 10), self.edge("pb_decode_inner", "decode_field"), self.edge("decode_field", "pb_decode_inner"))
        self.assertEqual(graph.depths()["decode_field"][0], 110 * check_stack.NESTED["decode"])
        self.assertEqual(graph.problems, [])

    def test_a_call_through_an_unknown_pointer_is_found(self):
        graph = self.graph(self.node("a", 8), self.edge("a", check_stack.INDIRECT))
        self.assertEqual(len(graph.problems), 1)
        self.assertIn("calls through a pointer", graph.problems[0])

    def test_a_frame_without_a_bound_is_found(self):
        self.assertIn("no fixed size", self.graph(self.node("a", 8, "dynamic")).problems[0])


if __name__ == "__main__":
    unittest.main()
