// SPDX-License-Identifier: Apache-2.0
// A camera and a projector behind a socket.
#include "symrig/rig/device_pair.hpp"

#include "rig/exec/client_talk.hpp"
#include "rig/pairs/device_words.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig {
namespace {

using rig::numbers_after;

Error wrong_request(std::string_view request) {
  return {ErrorCode::protocol, fmt::format("'{}' is no request to a pair of devices", request.substr(0, 60)),
          "see docs/pair-protocol.md"};
}

class DevicePair final : public PairService {
 public:
  DevicePair(RigDevices devices, ViewLayout layout, std::size_t pair)
      : devices_(std::move(devices)), layout_(layout), pair_(pair) {}

  /// The camera first: without a registration, its grid is that of the patterns.
  Result<void> begin() override {
    if (!camera_) {
      SYMRIG_TRY(camera_, devices_.camera());
    }
    if (!projector_) {
      SYMRIG_TRY(projector_, devices_.projector());
      loaded_ = 0;
    }
    if (projector_->planes().planes == 0) return {};
    projector_.reset();
    return Error{ErrorCode::bad_argument, "the projector shows bit planes",
                 "several pairs need projectors that show whole pictures"};
  }

  std::string facts() const override {
    return fmt::format("kind=devices pair={} layout={} {}", pair_ + 1, to_string(layout_),
                       rig::facts_of(*camera_, *projector_));
  }

  Result<bool> answer(const std::string& request, rig::ClientTalk& talk) override {
    if (const auto count = numbers_after("load", request, 1)) return load((*count)[0], talk);
    if (const auto index = numbers_after("show", request, 1)) return show((*index)[0], talk);
    if (const auto wanted = numbers_after("take", request, 2)) return take((*wanted)[0], (*wanted)[1], talk);
    if (request == "check") {
      SYMRIG_CHECK(of_projector(projector_->check()));
      return talk.send(std::string_view("done\n"));
    }
    if (request == "dead") return dead(talk);
    return wrong_request(request);
  }

 private:
  Result<bool> load(std::int64_t count, rig::ClientTalk& talk) {
    const std::int64_t values = projector_->grid().size();
    if (count < 1 || count > std::int64_t{rig::kMostLoaded} || count * values > rig::kLargestPairImage)
      return Error{ErrorCode::limit, fmt::format("{} patterns at once are too many", count),
                   "load fewer patterns"};
    std::vector<Pattern> patterns(static_cast<std::size_t>(count), Pattern(projector_->grid()));
    for (Pattern& pattern : patterns) {
      if (!talk.receive(std::as_writable_bytes(pattern.values()))) return false;
      if (!std::ranges::all_of(pattern.values(), [](float v) { return v >= 0 && v <= 1; }))
        return Error{ErrorCode::protocol, "a pattern has values that are not from 0 to 1"};
    }
    SYMRIG_CHECK(of_projector(projector_->load(patterns)));
    loaded_ = count;
    return talk.send(std::string_view("done\n"));
  }

  Result<bool> show(std::int64_t index, rig::ClientTalk& talk) {
    // After a new connection the projector may be another one, which the host must load.
    if (index >= loaded_)
      return Error{ErrorCode::device_lost, fmt::format("pattern {} of {} cannot be shown", index, loaded_),
                   "load it first"};
    SYMRIG_TRY(const Shown shown, of_projector(projector_->show(static_cast<std::size_t>(index))));
    return talk.send(fmt::format("shown {} {}\n", shown.refresh, shown.counted ? 1 : 0));
  }

  Result<bool> take(std::int64_t count, std::int64_t patience, rig::ClientTalk& talk) {
    if (count > std::int64_t{rig::kMostTaken} || patience > rig::kLongestPatience)
      return Error{ErrorCode::limit, fmt::format("{} frames at once are too many", count),
                   "take fewer frames"};
    auto taken = camera_->take(static_cast<std::size_t>(count), Nanoseconds(patience));
    if (!taken) camera_.reset();
    if (!taken) return taken.error();
    if (!talk.send(fmt::format("frames {}\n", taken->size()))) return false;
    for (const CameraFrame& frame : *taken) {
      const auto codes = std::as_bytes(std::span(frame.raw));
      if (!talk.send(fmt::format("frame {} {} {}\n", frame.sequence, frame.damaged ? 1 : 0, codes.size())) ||
          !talk.send(codes))
        return false;
    }
    return true;
  }

  bool dead(rig::ClientTalk& talk) {
    const Image<std::uint8_t>* known = camera_->dead();
    if (known == nullptr) return talk.send(std::string_view("dead 0\n"));
    return talk.send(fmt::format("dead {}\n", known->values().size())) &&
           talk.send(std::as_bytes(known->values()));
  }

  /// A projector that was lost is opened again for the next host.
  template <class T>
  Result<T> of_projector(Result<T> result) {
    if (!result) projector_.reset();
    return result;
  }

  RigDevices devices_;
  ViewLayout layout_;
  std::size_t pair_;
  std::unique_ptr<Camera> camera_;
  std::unique_ptr<Projector> projector_;
  std::int64_t loaded_ = 0;  // patterns that the projector holds
};

}  // namespace

std::unique_ptr<PairService> serve_devices(RigDevices devices, ViewLayout layout, std::size_t pair) {
  return std::make_unique<DevicePair>(std::move(devices), layout, pair);
}

}  // namespace symrig
