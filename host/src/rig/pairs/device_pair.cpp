// SPDX-License-Identifier: Apache-2.0
// A camera and a projector behind a socket.

#include "rig/pairs/pair_words.hpp"
#include "symrig/base/text.hpp"
#include "symrig/image/internal/size_text.hpp"
#include "symrig/rig/internal/client_talk.hpp"
#include "symrig/rig/pair_link.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig::rig {

namespace {

/// A number of a fact, from `least` to `most`.
template <class Number>
std::optional<Number> number_of(const std::string& text, Number least, Number most) {
  Number value{};
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = failed == std::errc{} && end == text.data() + text.size();
  return whole && value >= least && value <= most ? std::optional(value) : std::nullopt;
}

std::optional<Grid> grid_of(const std::string& text) {
  const auto sides = image::two_sides(text);
  if (!sides) return std::nullopt;
  const Grid grid{sides->first, sides->second};
  return grid.valid() && grid.size() <= kLargestPairImage ? std::optional(grid) : std::nullopt;
}

std::optional<NoiseModel> noise_of(const PairLink& link) {
  const auto full_well = number_of(link.fact("full_well"), 1.0, 1e9);
  const auto read_noise = number_of(link.fact("read_noise"), 0.0, 1e6);
  const auto gain = number_of(link.fact("gain"), 1e-9, 1e9);
  const auto pedestal = number_of(link.fact("pedestal"), 0.0, 65'535.0);
  const auto bits = number_of(link.fact("bits"), 1, 16);
  if (!full_well || !read_noise || !gain || !pedestal || !bits) return std::nullopt;
  const NoiseModel noise = NoiseModel::from_numbers(*full_well, *read_noise, *gain, *pedestal, *bits);
  return noise.valid() ? std::optional(noise) : std::nullopt;
}

}  // namespace

std::string facts_of(const Camera& camera, const Projector& projector) {
  const CameraTiming timing = camera.timing();
  const NoiseModel& noise = camera.noise();
  return fmt::format(
      "cells={} camera={} channels={} mosaic={} pacing={} refresh={} min_exposure={} max_exposure={} "
      "readout={} trigger_delay={} overlap={} "
      "full_well={} read_noise={} gain={} pedestal={} bits={}",
      to_string(projector.grid()), to_string(camera.grid()), camera.channels(),
      static_cast<int>(camera.mosaic()), projector.pacing() == Pacing::host ? "host" : "trigger",
      projector.refresh_period().count(), timing.min_exposure.count(), timing.max_exposure.count(),
      timing.readout.count(), timing.trigger_delay.count(), timing.overlap.count(), noise.full_well(),
      noise.read_noise(), noise.gain(), noise.pedestal(), noise.bits());
}

Result<DeviceFacts> read_facts(const PairLink& link) {
  constexpr std::int64_t kDay = 86'400'000'000'000;
  DeviceFacts facts;
  const auto cells = grid_of(link.fact("cells")), camera = grid_of(link.fact("camera"));
  const auto channels = number_of(link.fact("channels"), 1, 16),
             mosaic = number_of(link.fact("mosaic"), 0, 4);
  const auto time = [&](const char* key) { return number_of<std::int64_t>(link.fact(key), 0, kDay); };
  const auto refresh = time("refresh"), shortest = time("min_exposure"), longest = time("max_exposure"),
             readout = time("readout");
  const std::string pacing = link.fact("pacing");
  facts.noise = noise_of(link);
  const bool complete = cells && camera && channels && mosaic && refresh && shortest && longest && readout &&
                        facts.noise && (pacing == "host" || pacing == "trigger") &&
                        camera->size() * *channels <= kLargestPairImage;
  if (!complete)
    return Error{ErrorCode::protocol,
                 fmt::format("{} states its camera and projector incompletely", link.place()),
                 "see docs/pair-protocol.md"};
  facts.cells = *cells;
  facts.camera = *camera;
  facts.channels = *channels;
  facts.mosaic = static_cast<Mosaic>(*mosaic);
  facts.pacing = pacing == "host" ? Pacing::host : Pacing::trigger;
  facts.refresh = Nanoseconds(*refresh);
  // A pair that does not state these has neither.
  const auto delay = time("trigger_delay"), overlap = time("overlap");
  facts.timing = {Nanoseconds(*shortest), Nanoseconds(*longest), Nanoseconds(*readout),
                  Nanoseconds(delay.value_or(0)), Nanoseconds(overlap.value_or(0))};
  return facts;
}

std::optional<std::vector<std::int64_t>> numbers_after(std::string_view word, std::string_view line,
                                                       std::size_t count) {
  if (!line.starts_with(word)) return std::nullopt;
  line.remove_prefix(word.size());
  std::vector<std::int64_t> numbers;
  while (line.starts_with(' ') && numbers.size() < count) {
    line.remove_prefix(1);
    std::int64_t value = 0;
    const auto [end, failed] = std::from_chars(line.data(), line.data() + line.size(), value);
    if (failed != std::errc{} || value < 0) return std::nullopt;
    numbers.push_back(value);
    line.remove_prefix(static_cast<std::size_t>(end - line.data()));
  }
  if (!line.empty() || numbers.size() != count) return std::nullopt;
  return numbers;
}

}  // namespace symrig::rig

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
