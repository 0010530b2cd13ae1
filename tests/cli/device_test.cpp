// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"
#include "symrig/board/board.hpp"
#include "symrig/board/internal/sha256.hpp"
#include "symrig/boards/sim_board.hpp"
#include "unit/board/servers.hpp"
#include "unit/board/uf2_maker.hpp"

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace symrig::test::device_test {
namespace {

using Json = nlohmann::json;

/// Commands that speak to a board: list, info, identify, selftest.
class Device : public CommandTest {
 protected:
  Device() { unsetenv("SYMRIG_DEVICE"); }
  ~Device() override { unsetenv("SYMRIG_DEVICE"); }
  static constexpr int kDevice = 3;
};

TEST_F(Device, list_always_shows_the_simulated_board) {
  const Outcome text = symrig({"list"});
  EXPECT_EQ(text.code, 0) << text.err;
  EXPECT_TRUE(text.out.starts_with("uri")) << text.out;
  EXPECT_NE(text.out.find("\nsim:"), std::string::npos) << text.out;
  const Outcome json = symrig({"list", "--json", "-"});
  EXPECT_EQ(json.code, 0);
  const Json last = Json::parse(json.out)["boards"].back();
  EXPECT_EQ(last["uri"], "sim:");
  EXPECT_EQ(last["board"], "sim");
  EXPECT_EQ(last["serial"], "73696d2d30303031");
  EXPECT_EQ(last["state"], "safe");
  EXPECT_EQ(last["simulated"], true);
  EXPECT_TRUE(last["error"].is_null());
  EXPECT_TRUE(Json::parse(json.out)["projectors"].is_array());
}

TEST_F(Device, list_asks_boards_behind_sockets_and_says_which_do_not_answer) {
  const Outcome outcome =
      symrig({"list", "--device", "unix:" + path("none").string(), "--device", "sim:", "--json", "-"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  const Json boards = Json::parse(outcome.out)["boards"];
  ASSERT_GE(boards.size(), 3U);
  const Json& none = boards[boards.size() - 3];
  EXPECT_TRUE(none["board"].is_null());
  EXPECT_TRUE(none["state"].is_null());
  EXPECT_NE(none["error"].get<std::string>().find("No such file"), std::string::npos);
  expect_refusal({"list", "--device", "E66"}, kUsage, {"'E66'", "usb:SERIAL"});
}

// Which cameras are there is the machine's business; that their key is there is not.
TEST_F(Device, list_has_cameras_under_their_own_key) {
  const Outcome outcome = symrig({"list", "--json", "-"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Json cameras = Json::parse(outcome.out).at("cameras");
  ASSERT_TRUE(cameras.is_array());
  for (const Json& camera : cameras) {
    const auto node = camera["node"].get<std::string>();
    EXPECT_TRUE(node.starts_with("/dev/video") || node.starts_with("genicam:")) << node;
  }
}

TEST_F(Device, info_of_a_camera_that_is_not_there) {
  expect_refusal({"info", "--camera", "/dev/video-none"}, kDevice,
                 {"/dev/video-none is missing", "symrig list"});
  expect_refusal({"info", "--camera", "/dev/null"}, kDevice, {"/dev/null is not a V4L2 device"});
  expect_refusal({"info", "--camera", "/dev/null", "--device", "sim:"}, kUsage, {"--device"});
}

TEST_F(Device, info_tells_every_line) {
  const Outcome outcome = symrig({"info", "--device", "sim:", "--json", "-"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Json info = Json::parse(outcome.out);
  EXPECT_EQ(info["command"], "info");
  EXPECT_EQ(info["tick_hz"], 125'000'000);
  EXPECT_EQ(info["reset_cause"], "power");
  EXPECT_TRUE(info["fault"].is_null());
  ASSERT_EQ(info["lines"].size(), 6U);
  EXPECT_EQ(info["lines"][0]["name"], "projector_trigger");
  EXPECT_EQ(info["lines"][0]["output"], true);
  EXPECT_EQ(info["lines"][3]["waits"]["rising"], true);
  EXPECT_EQ(info["lines"][5]["trips"], true);
  const Outcome text = symrig({"info", "--device", "sim:"});
  for (const Json& line : info["lines"])
    EXPECT_NE(text.out.find(line["name"].get<std::string>()), std::string::npos);
  EXPECT_NE(text.out.find("8 ns (125000000 a second)"), std::string::npos) << text.out;
}

TEST_F(Device, the_environment_names_the_board) {
  setenv("SYMRIG_DEVICE", "sim:", 1);
  EXPECT_EQ(symrig({"info"}).code, 0);
  expect_refusal({"info", "--device", "unix:" + path("none").string()}, kDevice, {"cannot be reached"});
  setenv("SYMRIG_DEVICE", "nonsense:", 1);
  expect_refusal({"info"}, kUsage, {"'nonsense:' is not a device"});
}

TEST_F(Device, identify_blinks) {
  const Outcome outcome = symrig({"identify", "--device", "sim:", "--seconds", "2.5"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "sim 73696d2d30303031 blinks for 3 s\n");
  expect_refusal({"identify", "--device", "sim:", "--seconds", "61"}, kUsage, {"61", "0 and 60"});
  expect_refusal({"identify", "--device", "sim:", "--seconds", "nan"}, kUsage, {"nan"});
}

TEST_F(Device, selftest_passes_and_measures_through_a_jumper) {
  const std::vector<std::string> command{"selftest", "--device",          "sim:?jumper=lamp_enable:vsync",
                                         "--jumper", "lamp_enable:vsync", "--json",
                                         "-"};
  const Outcome outcome = symrig(command);
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Json test = Json::parse(outcome.out);
  EXPECT_EQ(test["passed"], true);
  ASSERT_EQ(test["checks"].size(), 6U);
  ASSERT_EQ(test["pulses"].size(), 7U);
  for (const Json& pulse : test["pulses"]) EXPECT_EQ(pulse["planned_ns"], pulse["measured_ns"]);
}

/// The verdict is an exit code too, and the report is there nevertheless.
TEST_F(Device, selftest_fails_without_the_wire) {
  const Outcome outcome =
      symrig({"selftest", "--device", "sim:", "--jumper", "lamp_enable:vsync", "--pings", "1"});
  EXPECT_EQ(outcome.code, kDevice);
  EXPECT_NE(outcome.out.find("FAIL jumper"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.err.find("symrig selftest: the board failed the check 'jumper'"), std::string::npos);
}

TEST_F(Device, selftest_options_are_checked) {
  expect_refusal({"selftest", "--device", "sim:", "--jumper", "lamp_enable"}, kUsage, {"OUT:IN"});
  expect_refusal({"selftest", "--device", "sim:", "--jumper", "lamp:vsync"}, kUsage,
                 {"'lamp'", "lamp_enable"});
  expect_refusal({"selftest", "--device", "sim:", "--pings", "0"}, kUsage, {"--pings 0"});
}

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
}  // namespace symrig::test::device_test
