// SPDX-License-Identifier: Apache-2.0
#include "board/firmware_files/sha256.hpp"
#include "command.hpp"
#include "symrig/board/board.hpp"
#include "symrig/boards/sim_board.hpp"
#include "unit/board/socket_server.hpp"
#include "unit/board/uf2_maker.hpp"

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>

namespace symrig::test::flash_test {
namespace {

namespace fs = std::filesystem;
using test::Listener, test::read_some, test::write_all;

/// What the simulated board says of its firmware.
BoardInfo simulated() {
  board_sim::SimBoard sim;
  const auto board = Board::connect(make_sim_link(sim));
  EXPECT_TRUE(board.ok());
  return board->info();
}

/// A simulated board behind a socket that, sent to its boot loader, answers nobody until a file lies on its
/// drive, and then starts anew.
class FlashableBoard {
 public:
  FlashableBoard(const fs::path& socket, fs::path drive)
      : listener_(Listener::local(socket.string())), drive_(std::move(drive)), thread_([this] { serve(); }) {}
  FlashableBoard(const FlashableBoard&) = delete;
  FlashableBoard& operator=(const FlashableBoard&) = delete;
  ~FlashableBoard() {
    stop_ = true;
    thread_.join();
  }
  int starts() const { return starts_; }

 private:
  void serve() {
    while (!stop_) {
      run_for_a_millisecond();
      if (!listener_.ready(1)) continue;
      const int fd = listener_.accept();
      if (!board_->in_bootloader()) serve_client(fd);
      close(fd);
    }
  }
  void serve_client(int fd) {
    std::vector<std::uint8_t> bytes;
    while (!stop_ && !board_->in_bootloader() && read_some(fd, bytes)) {
      board_->write(bytes);
      run_for_a_millisecond();
      write_all(fd, board_->read());
    }
  }
  void run_for_a_millisecond() {
    board_->advance_to(board_->now() + 125'000);
    if (!board_->in_bootloader() || !fs::exists(drive_ / "symrig.uf2")) return;
    board_ = std::make_unique<board_sim::SimBoard>();
    ++starts_;
  }

  Listener listener_;
  fs::path drive_;
  std::unique_ptr<board_sim::SimBoard> board_ = std::make_unique<board_sim::SimBoard>();
  std::atomic<bool> stop_{false};
  std::atomic<int> starts_{1};
  std::thread thread_;
};

class Flash : public CommandTest {
 protected:
  Flash() {
    fs::create_directory(drive());
    write_text(drive() / "INFO_UF2.TXT", "UF2 Bootloader v3.0\nBoard-ID: RPI-RP2\n");
  }
  fs::path drive() const { return path("drive"); }
  std::string device() const { return "unix:" + path("board").string(); }

  /// new.uf2 and new.json for a board of that name.
  void write_firmware(const std::string& board, const std::string& version, std::uint64_t hash) const {
    const auto file = test::make_uf2(test::make_image(4096, board, version, hash));
    test::write_file(path("new.uf2").string(), file);
    test::write_manifest(path("new.json").string(), board::sha256(file), board, version,
                         fmt::format("{:016x}", hash));
  }

  static constexpr int kDevice = 3;
};

TEST_F(Flash, verify_needs_no_board) {
  write_firmware("pico", "0.3.0", 0xABCDEF);
  const Outcome outcome = symrig({"flash", "--verify", "new.uf2"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  for (const char* word : {"0.3.0", "'pico'", "0000000000abcdef", "SHA-256"})
    EXPECT_NE(outcome.out.find(word), std::string::npos) << outcome.out;
  fs::remove(path("new.json"));
  expect_refusal({"flash", "--verify", "new.uf2"}, kBadInput, {"new.json does not exist"});
  expect_refusal({"flash", "--verify", "none.uf2"}, kBadInput, {"none.uf2"});
}

TEST_F(Flash, through_the_boot_loader_and_back) {
  const auto info = simulated();
  write_firmware(info.board, info.firmware_version, info.firmware_hash);
  const FlashableBoard board(path("board"), drive());
  const Outcome same = symrig({"flash", "new.uf2", "--device", device(), "--drive", drive().string()});
  EXPECT_EQ(same.code, 0) << same.err;
  EXPECT_NE(same.out.find("already runs this firmware"), std::string::npos) << same.out;
  EXPECT_EQ(board.starts(), 1);

  const Outcome again =
      symrig({"flash", "new.uf2", "--again", "--device", device(), "--drive", drive().string()});
  EXPECT_EQ(again.code, 0) << again.err;
  EXPECT_NE(again.out.find("runs firmware " + info.firmware_version), std::string::npos) << again.out;
  EXPECT_EQ(board.starts(), 2);
  EXPECT_EQ(read_text(drive() / "symrig.uf2"), read_text(path("new.uf2")));
}

TEST_F(Flash, a_board_that_comes_back_with_something_else_is_told) {
  const auto info = simulated();
  write_firmware(info.board, "9.9.9", info.firmware_hash + 1);
  const FlashableBoard board(path("board"), drive());
  const Outcome outcome = symrig({"flash", "new.uf2", "--device", device(), "--drive", drive().string()});
  EXPECT_EQ(outcome.code, kDevice);
  EXPECT_NE(outcome.err.find("not 9.9.9"), std::string::npos) << outcome.err;
  EXPECT_EQ(board.starts(), 2);
}

TEST_F(Flash, firmware_for_another_board_is_refused_before_anything_happens) {
  write_firmware("pico", "0.3.0", 1);
  const FlashableBoard board(path("board"), drive());
  const Outcome outcome = symrig({"flash", "new.uf2", "--device", device(), "--drive", drive().string()});
  EXPECT_EQ(outcome.code, kBadInput);
  EXPECT_NE(outcome.err.find("for board 'pico', the board is a 'sim'"), std::string::npos) << outcome.err;
  EXPECT_FALSE(fs::exists(drive() / "symrig.uf2"));
  EXPECT_EQ(board.starts(), 1);
}

TEST_F(Flash, no_drive_in_time) {
  const auto info = simulated();
  write_firmware(info.board, "9.9.9", info.firmware_hash + 1);
  const FlashableBoard board(path("board"), drive());
  const Outcome outcome = symrig(
      {"flash", "new.uf2", "--device", device(), "--drive", path("elsewhere").string(), "--wait", "0.2"});
  EXPECT_EQ(outcome.code, kBadInput);
  EXPECT_NE(outcome.err.find("not a boot loader's drive"), std::string::npos) << outcome.err;
}

TEST_F(Flash, options_are_checked) {
  expect_refusal({"flash"}, kUsage, {"file is required"});
  write_firmware("pico", "0.3.0", 1);
  expect_refusal({"flash", "new.uf2", "--wait", "-1"}, kUsage, {"--wait -1"});
  expect_refusal({"flash", "new.uf2", "--device", "nonsense:"}, kUsage, {"'nonsense:'"});
}

}  // namespace
}  // namespace symrig::test::flash_test
