// SPDX-License-Identifier: Apache-2.0
// The host's end: a board that answers whatever it likes. Nothing crashes, and every call ends within its
// attempts.
// A camera's driver that lies: its answers are a scripted driver's with bytes changed as the input says.
#include "compact_program.hpp"
#include "symrig/board/board.hpp"
#include "symrig/boards/sim_board.hpp"
#include "symrig/camera/v4l2_camera.hpp"
#include "symrig/protocol/messages.hpp"
#include "targets.hpp"
#include "unit/camera/fake_video.hpp"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

#include <linux/videodev2.h>
#include <sys/ioctl.h>

namespace symrig::fuzz {
namespace {

using protocol::Kind;
using Bytes = std::vector<std::uint8_t>;

constexpr int kAttempts = 2;
// Calls below, each with at most this many requests (configure: 2 and one a line), each sent kAttempts times;
// an acknowledgement for each thing received; urgent and chunk frames.
constexpr std::size_t kMostSends = std::size_t{64} * 40 * kAttempts;

void put_frame(Kind kind, std::uint16_t seq, std::uint16_t ack, std::uint8_t flags, const Bytes& body,
               Bytes& out) {
  Bytes wire(protocol::kMaxWire);
  wire.resize(protocol::encode_frame({protocol::kProtoMajor, kind, seq, ack, 8, flags},
                                     {body.data(), std::min(body.size(), protocol::kMaxBody)},
                                     {wire.data(), wire.size()}));
  out.insert(out.end(), wire.begin(), wire.end());
}

/// A real board behind a translator that lies as the input says.
class Liar final : public Link {
 public:
  explicit Liar(Input& input) : input_(input) {}

  Result<void> send(std::span<const std::uint8_t> bytes) override {
    require(++sends_ < kMostSends + taken_, "every call ends within its attempts");
    for (const std::uint8_t byte : bytes)
      if (host_.push(byte) == protocol::FrameDecoder::Event::frame) answer(host_.frame());
    board_.write(bytes);
    return {};
  }

  Result<Bytes> receive(Nanoseconds timeout) override {
    Bytes out = std::exchange(forged_, {});
    const std::uint64_t deadline = board_.now() + static_cast<std::uint64_t>(timeout.count()) / 8;
    collect(out);
    while (out.empty() && board_.next_event() <= deadline) {
      board_.advance();
      collect(out);
    }
    if (out.empty()) board_.advance_to(deadline);
    if (!out.empty()) ++taken_;
    return out;
  }
  Nanoseconds now() const override { return Nanoseconds(static_cast<std::int64_t>(board_.now() * 8)); }

 private:
  /// Something of its own before the board's answer, if the input has anything left.
  void answer(const protocol::Frame& frame) {
    const auto next = static_cast<std::uint16_t>(frame.header.seq + 1);
    switch (input_.byte() % 10) {
      case 1:
        return put_frame(Kind::reply, event_, next, 0, input_.bytes(input_.byte() % 64U), forged_);
      case 2:
        return raw(input_.bytes(input_.byte() % 64U));
      case 3:
        return put_frame(Kind::ack, event_, next, 0, {}, forged_);
      case 4:
        return put_frame(Kind::nak, event_, input_.byte(), 0, {}, forged_);
      case 5:
        return put_frame(Kind::event, event_++, next, 0, input_.bytes(input_.byte() % 32U), forged_);
      case 6:
        muted_ = !muted_;
        return;
      case 7:
        spoil_ = 1 + input_.byte() % 4U;
        return;
      case 8:
        return put_frame(Kind::reply, event_, frame.header.seq, protocol::flag::urgent,
                         input_.bytes(input_.byte() % 16U), forged_);
      default:
        return;
    }
  }
  void raw(const Bytes& bytes) { forged_.insert(forged_.end(), bytes.begin(), bytes.end()); }

  void collect(Bytes& out) {
    for (const std::uint8_t byte : board_.read())
      if (theirs_.push(byte) == protocol::FrameDecoder::Event::frame) pass(theirs_.frame(), out);
  }

  /// A frame of the real board, its body changed where the input asks for it: the sum still fits.
  void pass(const protocol::Frame& frame, Bytes& out) {
    if (muted_) return;
    Bytes body(frame.body.data, frame.body.data + frame.body.size);
    for (; spoil_ > 0 && !body.empty(); --spoil_) body[input_.byte() % body.size()] = input_.byte();
    if (frame.header.kind == Kind::event) event_ = static_cast<std::uint16_t>(frame.header.seq + 1);
    put_frame(frame.header.kind, frame.header.seq, frame.header.ack, frame.header.flags, body, out);
  }

  static board_sim::SimBoardConfig small() {
    board_sim::SimBoardConfig config;
    config.program_records = 128;
    return config;
  }

  Input& input_;
  board_sim::SimBoard board_{small()};
  protocol::FrameDecoder host_, theirs_;
  Bytes forged_;
  std::uint16_t event_ = 0;
  bool muted_ = false;
  unsigned spoil_ = 0;
  std::size_t sends_ = 0;
  std::size_t taken_ = 0;
};

/// Results do not matter, only that there are some.
template <class T>
void expect_error_or_reply(const Result<T>& result) {
  require(result.ok() || !result.error().what.empty(), "a failure says what failed");
}

/// Each line that the board claims to have, once.
std::vector<LineConfig> lines_of(const BoardInfo& info) {
  std::vector<LineConfig> lines;
  for (const LineInfo& line : info.lines) {
    LineConfig config;
    config.line = line.name;
    config.capture = true;
    lines.push_back(config);
  }
  return lines;
}

void talk(Board& board, Input& input) {
  using namespace std::chrono_literals;
  expect_error_or_reply(board.configure(lines_of(board.info())));
  const auto program = Program::from_bytes(compact_program(input, input.byte() % 80U));
  if (program.ok()) expect_error_or_reply(board.run(*program, 50ms));
  expect_error_or_reply(board.status());
  expect_error_or_reply(board.time());
  expect_error_or_reply(board.line_use("lamp_enable"));
  expect_error_or_reply(board.verify_program());
  expect_error_or_reply(board.set_line("lamp_enable", true));
  expect_error_or_reply(board.identify(1s));
  expect_error_or_reply(board.store_config("bench"));
  expect_error_or_reply(board.clear_fault());
  expect_error_or_reply(board.keep_alive(20ms));
  expect_error_or_reply(board.abort());
  expect_error_or_reply(board.reboot(false));
}

}  // namespace

void fuzz_reply(const std::uint8_t* data, std::size_t size) {
  using namespace std::chrono_literals;
  Input input({data, size});
  BoardOptions options;
  options.attempts = kAttempts;
  options.reply_timeout = 5ms;
  auto board = Board::connect(std::make_unique<Liar>(input), options);
  if (board) talk(*board, input);
}

namespace {

using namespace std::chrono_literals;
using camera::VideoNode;
using camera::Wake;

/// The part of an answer that holds no pointer of the caller's, from its begin.
std::size_t open_part(unsigned long request) {
  switch (request) {
    case VIDIOC_G_EXT_CTRLS:
    case VIDIOC_S_EXT_CTRLS:
      return 0;
    default:
      return _IOC_SIZE(request);
  }
}

class LyingNode final : public VideoNode {
 public:
  LyingNode(std::unique_ptr<VideoNode> honest, Input& input, std::mutex& mutex)
      : honest_(std::move(honest)), input_(input), mutex_(mutex) {}

  int control(unsigned long request, void* argument) override {
    const int reason = honest_->control(request, argument);
    const std::lock_guard lock(mutex_);
    const std::uint8_t lie = input_.byte();
    if (lie >= 250) return 1 + input_.byte() % 40;  // any errno
    const std::size_t size = open_part(request);
    for (int k = lie % 4; k > 0 && size > 0; --k) {
      const std::size_t at = input_.byte() % size;
      static_cast<std::uint8_t*>(argument)[at] = input_.byte();
    }
    return reason;
  }
  int map(std::size_t length, std::int64_t offset, std::span<const std::byte>& memory) override {
    return honest_->map(length, offset, memory);
  }
  void unmap(std::span<const std::byte> memory) override { honest_->unmap(memory); }
  Wake wait(Nanoseconds patience) override { return honest_->wait(patience); }
  void interrupt() override { honest_->interrupt(); }
  Nanoseconds now() override { return honest_->now(); }

 private:
  std::unique_ptr<VideoNode> honest_;
  Input& input_;
  std::mutex& mutex_;
};

class LyingSystem final : public camera::VideoSystem {
 public:
  explicit LyingSystem(Input& input) : input_(input) {
    fake->formats = {{V4L2_PIX_FMT_Y12, 16, {{6, 8}, {4, 4}}},
                     {V4L2_PIX_FMT_Y10P, 10, {{6, 8}}},
                     {V4L2_PIX_FMT_SRGGB8, 8, {{8, 8}}}};
    fake->controls = {
        {V4L2_CID_GAIN, "Gain", V4L2_CTRL_TYPE_INTEGER, 0, 255, 5, 0},
        {V4L2_CID_EXPOSURE_ABSOLUTE, "Mode", V4L2_CTRL_TYPE_MENU, 0, 2, 1, 0, 0, {"A", "", "B"}}};
    honest_.cameras["/dev/video0"] = fake;
  }
  std::vector<std::string> paths() override { return honest_.paths(); }
  std::string serial(const std::string& path) override { return honest_.serial(path); }
  int open(const std::string& path, std::unique_ptr<VideoNode>& node) override {
    std::unique_ptr<VideoNode> inner;
    const int reason = honest_.open(path, inner);
    if (reason == 0) node = std::make_unique<LyingNode>(std::move(inner), input_, mutex_);
    return reason;
  }

  std::shared_ptr<test::FakeCamera> fake = std::make_shared<test::FakeCamera>();

 private:
  Input& input_;
  std::mutex mutex_;
  test::FakeSystem honest_;
};

/// Results do not matter, only that there are some.
template <class T>
void expect_error_or_value(const Result<T>& result) {
  require(result.ok() || !result.error().what.empty(), "a failure says what failed");
}

CameraSettings settings_from(std::uint8_t choice) {
  CameraSettings settings;
  settings.device = "/dev/video0";
  settings.buffers = 2;
  if ((choice & 1U) != 0) settings.format = "Y10P";
  if ((choice & 2U) != 0) settings.region = {0, 0, {4, 4}, 2};
  if ((choice & 4U) != 0) settings.controls = {{"gain", "5"}, {"mode", "B"}};
  return settings;
}

/// Frames of the size that was promised, whatever the driver says.
void stream(V4l2Camera& camera, test::FakeCamera& fake) {
  const std::size_t pixels = camera.grid().size();
  for (std::uint32_t k = 0; k < 6; ++k) {
    test::FakeFrame frame;
    frame.sequence = k;
    frame.stamp = 100s + (k + 1) * 1ms;
    fake.deliver(frame);
    const auto frames = camera.take(1, 1ms);
    if (!frames) break;
    for (const CameraFrame& taken : *frames)
      require(taken.raw.size() == pixels, "a frame has its grid's size");
  }
  expect_error_or_value(camera.set_control("gain", "10"));
  require(!camera.describe().empty(), "a camera has a name");
}

}  // namespace

void fuzz_camera(const std::uint8_t* data, std::size_t size) {
  Input input({data, size});
  const CameraSettings settings = settings_from(input.byte());
  LyingSystem system(input);
  expect_error_or_value(look_at_camera(system, "/dev/video0"));
  auto camera = V4l2Camera::open(settings, system);
  expect_error_or_value(camera);
  if (!camera) return;
  stream(**camera, *system.fake);
  expect_error_or_value((*camera)->reopen());
}

}  // namespace symrig::fuzz
