// SPDX-License-Identifier: Apache-2.0
#include "symrig/board/boot_drive.hpp"

#include "bench.hpp"
#include "scratch.hpp"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

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
