// SPDX-License-Identifier: Apache-2.0

#include "symrig/board/firmware_file.hpp"

#include "bench.hpp"
#include "scratch.hpp"
#include "symrig/board/internal/sha256.hpp"
#include "uf2_maker.hpp"

#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::firmware_file_test {
namespace {

using namespace test;
using symrig::test::Scratch;

std::string digest_of(const std::string& text) {
  return board::sha256({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

/// NIST's examples for FIPS 180-4, and lengths around the padding's edges against a digest of Python's
/// hashlib.
TEST(Sha256, known_answers) {
  EXPECT_EQ(digest_of(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(digest_of("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(digest_of("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(digest_of(std::string(1'000'000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
  std::string chain;
  for (std::size_t length = 0; length < 200; ++length) chain += digest_of(std::string(length, 'x'));
  EXPECT_EQ(digest_of(chain), "f61ffcc417e1f0e59eba2da7fa32fbe05b64e478b68c6bacf990455f00248b98");
}

const std::vector<std::uint8_t>& image() {
  static const auto one = make_image(2048, "pico", "0.1.0", 0x1122334455667788);
  return one;
}

TEST(Uf2, gives_the_image_back) {
  const auto parsed = parse_uf2(make_uf2(image()));
  ASSERT_TRUE(parsed.ok()) << parsed.error().line();
  EXPECT_EQ(parsed->family, 0xE48BFF56U);
  EXPECT_EQ(parsed->address, 0x10000000U);
  EXPECT_EQ(parsed->bytes, image());
}

TEST(Uf2, gaps_are_erased_flash) {
  auto file = make_uf2(image());
  put_number(file, 7 * 512 + 12, 0x10000000 + 256 * 8, 4);  // the last block one further
  const auto parsed = parse_uf2(file);
  ASSERT_TRUE(parsed.ok());
  ASSERT_EQ(parsed->bytes.size(), 9U * 256);
  constexpr std::size_t kBlock = 256;
  for (std::size_t k = 7 * kBlock; k < 8 * kBlock; ++k) EXPECT_EQ(parsed->bytes[k], 0xFF);
  EXPECT_EQ(parsed->bytes[8 * kBlock], image()[7 * kBlock]);
}

struct Damage {
  std::string says;
  std::function<void(std::vector<std::uint8_t>&)> make;
};

TEST(Uf2, every_damage_is_named) {
  const auto set = [](std::size_t at, std::uint32_t value) {
    return [=](std::vector<std::uint8_t>& file) { put_number(file, at, value, 4); };
  };
  const std::vector<Damage> damages{
      {"not whole UF2 blocks", [](auto& file) { file.clear(); }},
      {"not whole UF2 blocks", [](auto& file) { file.resize(file.size() - 1); }},
      {"block 0 of 7 calls itself block 0 of 8", [](auto& file) { file.resize(file.size() - 512); }},
      {"block 0 does not begin", set(0, 0)},
      {"block 3 does not begin", set(3 * 512 + 4, 0)},
      {"block 7 does not begin", set(8 * 512 - 4, 0)},
      {"block 2 is not for the flash", set(2 * 512 + 8, 0x2001)},
      {"does not name its processor", set(2 * 512 + 8, 0)},
      {"block 1 holds 476 bytes", set(512 + 16, 476)},
      {"block 1 holds 256 bytes for address 0x10000104", set(512 + 12, 0x10000104)},
      {"block 4 of 8 calls itself block 5", set(4 * 512 + 20, 5)},
      {"block 5 is for another processor", set(5 * 512 + 28, 0xE48BFF59)},
      {"blocks 2 and 6 are for the same address", set(6 * 512 + 12, 0x10000200)},
      {"spread over", set(7 * 512 + 12, 0x20000000)}};
  for (const Damage& damage : damages) {
    auto file = make_uf2(image());
    damage.make(file);
    const auto parsed = parse_uf2(file);
    ASSERT_FALSE(parsed.ok()) << damage.says;
    EXPECT_EQ(parsed.error().code, ErrorCode::bad_format);
    EXPECT_NE(parsed.error().what.find(damage.says), std::string::npos) << parsed.error().line();
  }
}

/// Writes the file and a manifest whose digest fits.
Result<FirmwareFile> read_back(const std::vector<std::uint8_t>& file) {
  const Scratch scratch;
  const std::string path = (scratch / "pico.uf2").string();
  write_file(path, file);
  write_manifest((scratch / "pico.json").string(), board::sha256(file), "pico", "0.1.0", "1122334455667788");
  return read_firmware(path);
}

TEST(FirmwareFile, says_what_it_is) {
  const auto file = read_back(make_uf2(image()));
  ASSERT_TRUE(file.ok()) << file.error().line();
  EXPECT_EQ(file->manifest.board, "pico");
  EXPECT_EQ(file->manifest.version, "0.1.0");
  EXPECT_EQ(file->manifest.firmware_hash, 0x1122334455667788U);
  EXPECT_EQ(file->sha256, board::sha256(make_uf2(image())));
  EXPECT_TRUE(check_firmware_fits(file->manifest, "pico").ok());
  const auto other = check_firmware_fits(file->manifest, "mega2560");
  ASSERT_FALSE(other.ok());
  EXPECT_EQ(exit_code(other.error().code), 4);
}

TEST(FirmwareFile, what_a_board_could_not_run_is_refused) {
  const auto expect = [](const std::vector<std::uint8_t>& file, const std::string& says) {
    const auto read = read_back(file);
    ASSERT_FALSE(read.ok()) << says;
    EXPECT_EQ(read.error().code, ErrorCode::bad_format);
    EXPECT_NE(read.error().what.find(says), std::string::npos) << read.error().line();
  };
  expect(make_uf2(image(), 0xE48BFF59), "not for the RP2040");
  auto boot = image();
  boot[17] ^= 1U;
  expect(make_uf2(boot), "second boot stage");
  auto strange = image();
  strange[0x200] = 'X';
  expect(make_uf2(strange), "not firmware of symrig");
  auto newer = image();
  newer[0x208] = 2;
  expect(make_uf2(newer), "record has layout 2");
  auto shifted = make_uf2(image());
  for (std::size_t k = 0; k < 8; ++k) put_number(shifted, k * 512 + 12, 0x10010000 + 256 * k, 4);
  expect(shifted, "not where the flash begins");
  auto cut = image();  // the magic so near the end that the record cannot be whole
  std::copy_n(cut.begin() + 0x200, 8, cut.end() - 55);
  cut[0x200] = 'X';
  expect(make_uf2(cut), "not firmware of symrig");
}

TEST(FirmwareFile, another_kind_of_file_is_told_before_its_manifest_is_missed) {
  const Scratch scratch;
  const std::string path = (scratch / "notes.txt").string();
  for (const char* text : {"", "UF2", "hello, I am a longer text and no UF2 file at all"}) {
    std::ofstream(path) << text;
    const auto file = read_firmware(path);
    ASSERT_FALSE(file.ok());
    EXPECT_EQ(file.error().code, ErrorCode::bad_format) << text;
    EXPECT_NE(file.error().what.find("not a UF2 file"), std::string::npos) << file.error().line();
  }
}

TEST(FirmwareFile, the_manifest_beside_it_must_fit) {
  const Scratch scratch;
  const std::string path = (scratch / "pico.uf2").string();
  EXPECT_EQ(read_firmware(path).error().code, ErrorCode::not_found);
  write_file(path, make_uf2(image()));
  const auto alone = read_firmware(path);
  ASSERT_FALSE(alone.ok());
  EXPECT_EQ(alone.error().code, ErrorCode::not_found);
  EXPECT_NE(alone.error().what.find("pico.json"), std::string::npos);
  const std::string manifest = (scratch / "pico.json").string();
  for (const char* text : {"not JSON", "[]", "{}", R"({"sha256": 5, "board": "pico"})"}) {
    std::ofstream(manifest) << text;
    EXPECT_EQ(read_firmware(path).error().code, ErrorCode::bad_format) << text;
  }
  const std::string hash = "1122334455667788";
  write_manifest(manifest, std::string(64, '0'), "pico", "0.1.0", hash);
  EXPECT_NE(read_firmware(path).error().what.find("its SHA-256 is"), std::string::npos);
  const std::string digest = board::sha256(make_uf2(image()));
  write_manifest(manifest, digest, "mega2560", "0.1.0", hash);
  EXPECT_NE(read_firmware(path).error().what.find("its manifest says"), std::string::npos);
  write_manifest(manifest, digest, "pico", "0.2.0", hash);
  EXPECT_FALSE(read_firmware(path).ok());
  write_manifest(manifest, digest, "pico", "0.1.0", "1122334455667789");
  EXPECT_FALSE(read_firmware(path).ok());
  write_manifest(manifest, digest, "pico", "0.1.0", hash);
  EXPECT_TRUE(read_firmware(path).ok());
}

}  // namespace
}  // namespace symrig::firmware_file_test

namespace symrig::boot_drive_test {
namespace {

namespace fs = std::filesystem;
using symrig::test::Scratch;

fs::path make_drive(const Scratch& scratch, const std::string& name, const std::string& board = "RPI-RP2") {
  fs::create_directory(scratch / name);
  std::ofstream(scratch / name / "INFO_UF2.TXT")
      << "UF2 Bootloader v3.0\nModel: Raspberry Pi RP2\nBoard-ID: " << board << "\n";
  return scratch / name;
}

TEST(BootDrive, is_known_by_what_it_says) {
  const Scratch scratch;
  EXPECT_TRUE(check_boot_drive(make_drive(scratch, "RPI-RP2")).ok());
  EXPECT_EQ(check_boot_drive(make_drive(scratch, "other", "SAMD51")).error().code, ErrorCode::bad_format);
  EXPECT_EQ(check_boot_drive(scratch.folder()).error().code, ErrorCode::not_found);
}

TEST(BootDrive, is_found_among_the_mounts) {
  const Scratch scratch;
  const fs::path plain = make_drive(scratch, "RPI-RP2");
  const fs::path blank = make_drive(scratch, "my drive");
  const fs::path ext = make_drive(scratch, "ext");
  std::string escaped = blank.string();
  escaped.replace(escaped.find(' '), 1, "\\040");
  std::ofstream(scratch / "mounts") << "proc /proc proc rw 0 0\n/dev/sda1 " << plain.string()
                                    << " vfat rw 0 0\n/dev/sdb1 " << escaped << " vfat rw 0 0\n/dev/sdc1 "
                                    << ext.string() << " ext4 rw 0 0\n"
                                    << "/dev/sdd1 " << scratch.folder().string() << " vfat rw 0 0\n";
  const auto drives = boot_drives(scratch / "mounts");
  EXPECT_EQ(drives, (std::vector<fs::path>{plain, blank}));
  EXPECT_TRUE(boot_drives(scratch / "none").empty());
}

TEST(BootDrive, takes_a_file_whole) {
  const Scratch scratch;
  const fs::path drive = make_drive(scratch, "RPI-RP2");
  std::string text(100'000, 'x');
  std::ofstream(scratch / "new.uf2") << text;
  ASSERT_OK(copy_to_boot_drive(scratch / "new.uf2", drive));
  std::ifstream copy(drive / "symrig.uf2");
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(copy), {}), text);
  EXPECT_FALSE(copy_to_boot_drive(scratch / "none.uf2", drive).ok());
  EXPECT_FALSE(copy_to_boot_drive(scratch / "new.uf2", scratch.folder()).ok());
}

TEST(BootDrive, is_not_written_over_the_file_itself) {
  const Scratch scratch;
  const fs::path drive = make_drive(scratch, "RPI-RP2");
  std::ofstream(drive / "symrig.uf2") << "firmware";
  fs::create_hard_link(drive / "symrig.uf2", scratch / "link.uf2");
  for (const fs::path& file : {drive / "symrig.uf2", scratch / "link.uf2"}) {
    const auto refused = copy_to_boot_drive(file, drive);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::bad_argument);
    EXPECT_EQ(fs::file_size(drive / "symrig.uf2"), 8U);
  }
}

}  // namespace
}  // namespace symrig::boot_drive_test
