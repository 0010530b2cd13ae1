// SPDX-License-Identifier: Apache-2.0
// A camera and a projector of another computer.
#include "rig/pairs/pair_words.hpp"
#include "symrig/base/text.hpp"
#include "symrig/rig/pair_link.hpp"

#include <chrono>
#include <limits>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace symrig {
namespace {

/// The connection that both devices share. It is made when a device is opened.
class Shared {
 public:
  Shared(PairAddress address, ViewLayout layout, std::size_t pair, Grid cells, PairLink::KeepWaiting waiting)
      : address_(std::move(address)),
        layout_(layout),
        pair_(pair),
        cells_(cells),
        waiting_(std::move(waiting)) {}

  /// Connects, if there is no connection.
  Result<void> open() {
    if (link_) return {};
    SYMRIG_TRY(auto link, PairLink::open(address_, waiting_));
    SYMRIG_CHECK(check_place(*link));
    SYMRIG_TRY(facts_, rig::read_facts(*link));
    if (facts_.cells != cells_)
      return Error{ErrorCode::size_mismatch,
                   fmt::format("{} shows {}, but each pair has cells of {}", link->place(),
                               to_string(facts_.cells), to_string(cells_)),
                   "give the same capture.grid on both computers"};
    link_ = std::move(link);
    return {};
  }

  const rig::DeviceFacts& facts() const { return facts_; }
  std::string place() const { return address_.uri.text(); }

  /// Calls `talk` with the connection. After an error, the connection is closed: an answer that comes later
  /// would be taken for another one.
  template <class Talk>
  auto with_link(const Talk& talk) -> decltype(talk(std::declval<PairLink&>())) {
    if (!link_)
      return Error{ErrorCode::device_lost, fmt::format("{} is not connected", place()), "connect it again"};
    auto result = talk(*link_);
    if (!result) link_.reset();
    return result;
  }

 private:
  Result<void> check_place(const PairLink& link) const {
    const auto wrong = [&](const char* what, const std::string& is, const std::string& wanted) {
      return Error{
          ErrorCode::bad_argument,
          fmt::format("{} has the {} {}, but {} is needed", link.place(), what, printable_line(is), wanted),
          "start each pair in the order of the rig file, with its layout"};
    };
    if (link.fact("kind") != "devices") return wrong("kind", link.fact("kind"), "devices");
    if (link.fact("layout") != to_string(layout_))
      return wrong("layout", link.fact("layout"), to_string(layout_));
    if (link.fact("pair") != std::to_string(pair_ + 1))
      return wrong("place", link.fact("pair"), std::to_string(pair_ + 1));
    return {};
  }

  PairAddress address_;
  ViewLayout layout_;
  std::size_t pair_;
  Grid cells_;
  PairLink::KeepWaiting waiting_;
  std::unique_ptr<PairLink> link_;
  rig::DeviceFacts facts_;
};

Error unexpected(const PairLink& link, std::string_view answer) {
  return {ErrorCode::protocol, fmt::format("{} answers '{}'", link.place(), printable_line(answer)),
          "see docs/pair-protocol.md"};
}

/// Numbers of the answer, after `word`.
Result<std::vector<std::int64_t>> receive_numbers(PairLink& link, std::string_view word, std::size_t count) {
  SYMRIG_TRY(const std::string line, link.receive_line());
  const auto numbers = rig::numbers_after(word, line, count);
  if (numbers) return *numbers;
  return unexpected(link, line);
}

class LinkedProjector final : public Projector {
 public:
  explicit LinkedProjector(std::shared_ptr<Shared> shared)
      : shared_(std::move(shared)), facts_(shared_->facts()) {}

  Grid grid() const override { return facts_.cells; }
  Nanoseconds refresh_period() const override { return facts_.refresh; }
  Pacing pacing() const override { return facts_.pacing; }

  Result<void> load(std::span<const Pattern> patterns) override {
    for (const Pattern& pattern : patterns)
      if (pattern.grid() != facts_.cells || pattern.channels() != 1)
        return Error{ErrorCode::size_mismatch,
                     fmt::format("a pattern is {}, but {} shows {}", to_string(pattern.grid()),
                                 shared_->place(), to_string(facts_.cells)),
                     "give patterns on the projector's grid"};
    return shared_->with_link([&](PairLink& link) -> Result<void> {
      SYMRIG_CHECK(link.send(fmt::format("load {}\n", patterns.size())));
      for (const Pattern& pattern : patterns) SYMRIG_CHECK(link.send(std::as_bytes(pattern.values())));
      SYMRIG_CHECK(receive_numbers(link, "done", 0));
      return {};
    });
  }

  /// The pattern is there when the answer comes, or before. The clock is this computer's.
  Result<Shown> show(std::size_t index) override {
    return shared_->with_link([&](PairLink& link) -> Result<Shown> {
      SYMRIG_CHECK(link.send(fmt::format("show {}\n", index)));
      SYMRIG_TRY(const auto shown, receive_numbers(link, "shown", 2));
      const auto now = std::chrono::steady_clock::now().time_since_epoch();
      return Shown{static_cast<std::uint64_t>(shown[0]),
                   {std::chrono::duration_cast<Nanoseconds>(now)},
                   shown[1] != 0};
    });
  }

  Result<void> check() override {
    return shared_->with_link([&](PairLink& link) -> Result<void> {
      SYMRIG_CHECK(link.send(std::string_view("check\n")));
      SYMRIG_CHECK(receive_numbers(link, "done", 0));
      return {};
    });
  }
  std::string describe() const override {
    return fmt::format("projector {} at {}", to_string(facts_.cells), shared_->place());
  }

 private:
  std::shared_ptr<Shared> shared_;
  rig::DeviceFacts facts_;
};

class LinkedCamera final : public Camera {
 public:
  LinkedCamera(std::shared_ptr<Shared> shared, Image<std::uint8_t> dead)
      : shared_(std::move(shared)), facts_(shared_->facts()), dead_(std::move(dead)) {}

  /// Asks for its dead pixels.
  static Result<std::unique_ptr<Camera>> open(const std::shared_ptr<Shared>& shared) {
    const rig::DeviceFacts& facts = shared->facts();
    SYMRIG_TRY(auto dead, shared->with_link([&](PairLink& link) -> Result<Image<std::uint8_t>> {
      SYMRIG_CHECK(link.send(std::string_view("dead\n")));
      SYMRIG_TRY(const auto count, receive_numbers(link, "dead", 1));
      Image<std::uint8_t> pixels;
      if (count[0] == 0) return pixels;
      if (count[0] != facts.camera.size()) return unexpected(link, fmt::format("dead {}", count[0]));
      pixels = Image<std::uint8_t>(facts.camera);
      SYMRIG_CHECK(link.receive(std::as_writable_bytes(pixels.values())));
      for (std::uint8_t& one : pixels.values()) one = one != 0 ? 1 : 0;
      return pixels;
    }));
    return std::unique_ptr<Camera>(std::make_unique<LinkedCamera>(shared, std::move(dead)));
  }

  Grid grid() const override { return facts_.camera; }
  int channels() const override { return facts_.channels; }
  Mosaic mosaic() const override { return facts_.mosaic; }
  CameraTiming timing() const override { return facts_.timing; }
  const NoiseModel& noise() const override { return *facts_.noise; }
  const Image<std::uint8_t>* dead() const override { return dead_.empty() ? nullptr : &dead_; }

  Result<std::vector<CameraFrame>> take(std::size_t count, Nanoseconds patience) override {
    return shared_->with_link([&](PairLink& link) -> Result<std::vector<CameraFrame>> {
      SYMRIG_CHECK(link.send(fmt::format("take {} {}\n", count, patience.count())));
      SYMRIG_TRY(const auto number, receive_numbers(link, "frames", 1));
      std::vector<CameraFrame> frames;
      for (std::int64_t k = 0; k < number[0]; ++k) {
        SYMRIG_TRY(CameraFrame frame, receive_frame(link));
        frames.push_back(std::move(frame));
      }
      return frames;
    });
  }
  std::string describe() const override {
    return fmt::format("camera {} at {}", to_string(facts_.camera), shared_->place());
  }

 private:
  Result<CameraFrame> receive_frame(PairLink& link) const {
    SYMRIG_TRY(const auto words, receive_numbers(link, "frame", 3));
    const std::int64_t values = facts_.camera.size() * facts_.channels;
    // A damaged frame may have no content.
    const std::int64_t whole = values * std::int64_t{sizeof(std::uint16_t)};
    if (words[2] != whole && !(words[1] != 0 && words[2] == 0))
      return unexpected(link, fmt::format("frame {} {} {}", words[0], words[1], words[2]));
    CameraFrame frame;
    frame.sequence = static_cast<std::uint64_t>(words[0]);
    frame.damaged = words[1] != 0;
    frame.raw.resize(static_cast<std::size_t>(words[2]) / sizeof(std::uint16_t));
    SYMRIG_CHECK(link.receive(std::as_writable_bytes(std::span(frame.raw))));
    return frame;
  }

  std::shared_ptr<Shared> shared_;
  rig::DeviceFacts facts_;
  Image<std::uint8_t> dead_;
};

}  // namespace

RigDevices linked_devices(PairAddress address, ViewLayout layout, std::size_t pair, Grid cells,
                          PairLink::KeepWaiting keep_waiting) {
  const auto shared =
      std::make_shared<Shared>(std::move(address), layout, pair, cells, std::move(keep_waiting));
  RigDevices devices;
  devices.camera = [shared]() -> Result<std::unique_ptr<Camera>> {
    SYMRIG_CHECK(shared->open());
    return LinkedCamera::open(shared);
  };
  devices.projector = [shared]() -> Result<std::unique_ptr<Projector>> {
    SYMRIG_CHECK(shared->open());
    return std::unique_ptr<Projector>(std::make_unique<LinkedProjector>(shared));
  };
  return devices;
}

}  // namespace symrig
