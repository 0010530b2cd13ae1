// SPDX-License-Identifier: Apache-2.0
// symrigd as a USB device: libusb on one side, FunctionFS on the other, the kernel's USB stack between them.
// SYMRIG_USB_ROUNDS and SYMRIG_USB_UNPLUGS set the number of rounds.
#include "assert_ok.hpp"
#include "bench-vm/selftest/guest.hpp"
#include "daemon_process.hpp"
#include "symrig/board/link.hpp"
#include "symrig/protocol/frame.hpp"
#include "symrig/protocol/messages.hpp"

#include <atomic>
#include <cstdio>
#include <optional>
#include <random>

namespace symrig::bench::board_usb_test {
namespace {

using namespace std::chrono_literals;

unsigned number_from(const char* variable, unsigned otherwise) {
  const char* text = std::getenv(variable);
  return text != nullptr ? static_cast<unsigned>(std::stoul(text)) : otherwise;
}

bool shell(const std::string& command) {
  return std::system(command.c_str()) == 0;  // NOLINT(cert-env33-c): commands of this file, in the guest
}

std::string usb_link() {
  return "usb = \"" + bench_vm::place("BENCH_FFS") +
         "\"\n[realtime]\nlock_memory = false\nlateness_us = 1000\n";
}

Result<std::unique_ptr<Link>> open_usb() {
  SYMRIG_TRY(const auto uri, DeviceUri::parse("usb:"));
  return open_link(uri);
}

Result<Board> connect_usb() {
  SYMRIG_TRY(auto link, open_usb());
  return Board::connect(std::move(link));
}

/// The device appears on the bus a moment after its driver reports it.
Result<Board> connect_patiently() {
  auto board = connect_usb();
  for (int k = 0; k < 2000 && !board; ++k) {
    std::this_thread::sleep_for(50ms);
    board = connect_usb();
  }
  return board;
}

/// Sends a number that comes back: an urgent time_ping, which needs no session.
class Echo {
 public:
  explicit Echo(Link& link) : link_(link) {}

  Result<bool> round_trip(std::uint64_t number) {
    symrig_wire_Request request = symrig_wire_Request_init_zero;
    request.which_body = symrig_wire_Request_time_ping_tag;
    request.body.time_ping.host_ns = number;
    protocol::BodyBuffer body{};
    const std::size_t size = encode(request, body);
    const auto token = static_cast<std::uint16_t>(number);
    std::vector<std::uint8_t> wire(protocol::kMaxWire);
    wire.resize(protocol::encode_frame(
        {protocol::kProtoMajor, protocol::Kind::request, token, 0, 0, protocol::flag::urgent},
        {body.bytes, size}, {wire.data(), wire.size()}));
    SYMRIG_CHECK(link_.send(wire));
    return answered(token, number);
  }

 private:
  Result<bool> answered(std::uint16_t token, std::uint64_t number) {
    while (true) {
      SYMRIG_TRY(const auto bytes, link_.receive(60s));
      if (bytes.empty()) return Error{ErrorCode::timeout, "no answer within 60 s"};
      std::optional<bool> matches;
      for (const std::uint8_t byte : bytes)
        if (decoder_.push(byte) == protocol::FrameDecoder::Event::frame)
          matches = check(decoder_.frame(), token, number);
      if (matches) return *matches;
    }
  }
  static bool check(const protocol::Frame& frame, std::uint16_t token, std::uint64_t number) {
    symrig_wire_Reply reply = symrig_wire_Reply_init_zero;
    return frame.header.kind == protocol::Kind::reply && frame.header.ack == token &&
           protocol::decode(frame.body, reply) && reply.which_body == symrig_wire_Reply_time_tag &&
           reply.body.time.host_ns == number;
  }

  Link& link_;
  protocol::FrameDecoder decoder_;
};

std::size_t open_files(pid_t pid) {
  const std::filesystem::directory_iterator entries("/proc/" + std::to_string(pid) + "/fd");
  return static_cast<std::size_t>(std::distance(begin(entries), end(entries)));
}

class BoardUsb : public testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(shell("bench-usb plug")) << daemon_.log(); }
  void TearDown() override { shell("[ \"$(bench-usb state)\" = 'not attached' ] || bench-usb unplug"); }

  DaemonProcess daemon_{usb_link()};
};

TEST_F(BoardUsb, SaysWhatEveryBoardSays) {
  ASSERT_OK(connect_patiently());
  const auto found = find_boards();
  ASSERT_OK(found);
  ASSERT_EQ(found->size(), 1U);
  EXPECT_EQ(found->front().product.rfind("symrig", 0), 0U);
  const auto board = connect_usb();
  ASSERT_OK(board);
  EXPECT_EQ(board->info().board, "linux");
  EXPECT_TRUE(board->info().best_effort());
}

TEST_F(BoardUsb, RoundTripsComeBackAsTheyWere) {
  ASSERT_OK(connect_patiently());
  auto link = open_usb();
  ASSERT_OK(link);
  Echo echo(**link);
  const unsigned rounds = number_from("SYMRIG_USB_ROUNDS", 100'000);
  unsigned mismatches = 0;
  std::mt19937_64 random(1);
  for (unsigned k = 0; k < rounds; ++k) {
    const auto matches = echo.round_trip(random());
    ASSERT_OK(matches);
    if (!*matches) ++mismatches;
  }
  EXPECT_EQ(mismatches, 0U);
  std::printf("%u round trips, %u mismatches\n", rounds, mismatches);
}

/// Frames of full packets, and a full window of them. None may wait for a short packet that never comes.
TEST_F(BoardUsb, TakesAProgramThatFillsItsMemory) {
  auto board = connect_patiently();
  ASSERT_OK(board);
  ProgramBuilder builder(board->info());
  const std::size_t records = board->info().program_bytes / 8 - 1;
  for (std::size_t k = 0; k < records; ++k) builder.hold(Ticks{board->info().min_dwell.count * 4 + k});
  const auto program = builder.end();
  ASSERT_OK(program);
  ASSERT_OK(board->configure({}));
  ASSERT_OK(board->upload(*program));
  ASSERT_OK(board->verify_program());
}

/// The cable is unplugged at any moment, also during a run. The host gets an error, the board goes to its
/// safe levels, and nothing stays behind.
TEST_F(BoardUsb, EveryUnplugIsReported) {
  const unsigned unplugs = number_from("SYMRIG_USB_UNPLUGS", 50);
  std::mt19937 random(7);
  std::uniform_int_distribution<int> moment(0, 60);
  ASSERT_OK(connect_patiently());
  const std::size_t files_before = open_files(daemon_.pid());
  unsigned reported = 0;
  unsigned faults = 0;
  unsigned runs = 0;
  for (unsigned k = 0; k < unplugs; ++k) {
    auto board = connect_patiently();
    ASSERT_OK(board);
    const auto before = board->status();
    ASSERT_OK(before);
    if (before->fault) {
      EXPECT_EQ(before->fault->name, "link_lost");
      ++faults;
      ASSERT_OK(board->clear_fault());
    }
    const bool run = k % 2 == 0;
    if (run) {
      ProgramBuilder builder(board->info());
      builder.set("camera_trigger", true).hold(4s).hold(4s).hold(4s);
      const auto program = builder.end();
      ASSERT_OK(program);
      ASSERT_OK(board->configure({}));
      ASSERT_OK(board->upload(*program));
      ASSERT_OK(board->arm());
      ASSERT_OK(board->start());
      ++runs;
    }
    std::thread hand([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(moment(random)));
      shell("bench-usb unplug");
    });
    Result<void> alive;
    for (int pings = 0; alive && pings < 100'000; ++pings) {
      alive = board->keep_alive(5s);
    }
    hand.join();
    ASSERT_FALSE(alive);
    EXPECT_EQ(alive.error().code, ErrorCode::device_lost) << alive.error().line();
    ++reported;
    ASSERT_TRUE(shell("bench-usb plug"));
  }
  auto board = connect_patiently();
  ASSERT_OK(board);
  const auto last = board->status();
  ASSERT_OK(last);
  if (last->fault) ++faults;
  EXPECT_EQ(reported, unplugs);
  EXPECT_EQ(faults, runs) << daemon_.log();
  EXPECT_EQ(open_files(daemon_.pid()), files_before);
  std::printf("%u unplugs, %u reported; %u amid a run, %u faults\n", unplugs, reported, runs, faults);
}

TEST_F(BoardUsb, AKilledDaemonLeavesTheHostWithANamedError) {
  auto board = connect_patiently();
  ASSERT_OK(board);
  daemon_.end(SIGKILL);
  Result<void> alive;
  for (int pings = 0; alive && pings < 1000; ++pings) {
    const auto time = board->time();
    if (!time) alive = time.error();
  }
  ASSERT_FALSE(alive);
  EXPECT_EQ(alive.error().code, ErrorCode::device_lost);
  std::printf("the host says: %s\n", alive.error().line().c_str());
  daemon_.start();
  ASSERT_TRUE(shell("bench-usb plug"));
  auto again = connect_patiently();
  ASSERT_OK(again);
  const auto status = again->status();
  ASSERT_OK(status);
  EXPECT_EQ(status->reset_cause, ResetCause::watchdog);
}

}  // namespace
}  // namespace symrig::bench::board_usb_test
