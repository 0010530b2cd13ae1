// SPDX-License-Identifier: Apache-2.0

#include "sim/pair_images.hpp"

#include "sim/rig_profiles.hpp"
#include "sim/view.hpp"
#include "symrig/base/text.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <map>
#include <utility>

#include <fmt/format.h>

namespace symrig::sim {

Result<PairScene> parse_pair_scene(std::string_view uri, ViewLayout pairs) {
  PairScene scene;
  SYMRIG_TRY(scene.uri, parse_scene_uri(uri));
  scene.layout = {pairs, scene.uri.size};
  const ViewLayout views = views_of(scene.uri);
  const bool dealt = pairs.rows >= 1 && pairs.cols >= 1 && views.rows % pairs.rows == 0 &&
                     views.cols % pairs.cols == 0 && views.fits(scene.uri.size);
  if (!dealt)
    return Error{ErrorCode::bad_argument,
                 fmt::format("the {} views of sim:{} cannot be dealt to {} pairs", to_string(views),
                             scene.uri.name, to_string(pairs)),
                 "give a scene with several views, such as sim:views2 for 1x2 pairs"};
  if (is_bench(scene.uri))
    return Error{ErrorCode::bad_argument, "simulated pairs have cameras that share the projectors' cells",
                 "remove the keys of a bench, such as camera and turn"};
  if (profile_of(scene.uri).planes > 0)
    return Error{ErrorCode::bad_argument,
                 fmt::format("the profile {} shows bit planes, but several pairs need whole pictures",
                             scene.uri.profile),
                 "give another profile, such as screen60"};
  return scene;
}

namespace {

static_assert(std::endian::native == std::endian::little, "the numbers of the framing are little-endian");

template <class T>
void append(std::vector<std::byte>& bytes, std::span<const T> values) {
  const auto more = std::as_bytes(values);
  bytes.insert(bytes.end(), more.begin(), more.end());
}

template <class T>
void append_one(std::vector<std::byte>& bytes, const T& value) {
  append(bytes, std::span<const T>(&value, 1));
}

/// A number from 1 to `most` at the beginning of the text, which it removes.
std::optional<std::size_t> take_number(std::string_view& text, std::size_t most) {
  std::size_t value = 0;
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failed != std::errc{} || value > most) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return value;
}

}  // namespace

std::optional<DevelopHeader> parse_develop(std::string_view line) {
  constexpr std::string_view kDevelop = "develop ";
  if (!line.starts_with(kDevelop)) return std::nullopt;
  line.remove_prefix(kDevelop.size());
  const auto patterns = take_number(line, kMostPatterns);
  if (!patterns || !line.starts_with(' ')) return std::nullopt;
  line.remove_prefix(1);
  const auto exposures = take_number(line, kMostExposures);
  if (!exposures || *exposures == 0 || !line.empty()) return std::nullopt;
  return DevelopHeader{*patterns, *exposures};
}

std::vector<std::byte> encode_develop(std::span<const LitPattern> patterns,
                                      std::span<const LitExposure> exposures) {
  std::vector<std::byte> bytes;
  for (const LitPattern& one : patterns) {
    append_one(bytes, one.shown_before);
    append(bytes, one.pattern->values());
  }
  for (const LitExposure& one : exposures) {
    append_one(bytes, ExposureHead{one.seconds, one.noise, one.shares.size()});
    for (const LitExposure::Share& part : one.shares)
      append_one(bytes, ShareRecord{part.pattern, part.share});
  }
  return bytes;
}

std::size_t frame_bytes(bool noisy, std::int64_t values) {
  return static_cast<std::size_t>(values) * (noisy ? sizeof(std::uint16_t) : sizeof(float));
}

namespace {

/// Exposures from `first` on that fit into one request, with their patterns.
struct Request {
  std::vector<LitPattern> patterns;
  std::vector<LitExposure> exposures;
};

Request next_request(std::span<const LitPattern> patterns, std::span<const LitExposure> exposures) {
  Request request;
  std::map<std::uint32_t, std::uint32_t> places;  // of the patterns in this request
  for (const LitExposure& exposure : exposures) {
    std::size_t more = 0;
    for (const auto& part : exposure.shares) more += places.contains(part.pattern) ? 0 : 1;
    const bool full = request.exposures.size() == kMostExposures || places.size() + more > kMostPatterns;
    if (full && !request.exposures.empty()) break;
    LitExposure own = exposure;
    for (auto& part : own.shares) {
      const auto [place, is_new] =
          places.try_emplace(part.pattern, static_cast<std::uint32_t>(request.patterns.size()));
      if (is_new) request.patterns.push_back(patterns[part.pattern]);
      part.pattern = place->second;
    }
    request.exposures.push_back(std::move(own));
  }
  return request;
}

}  // namespace

RemoteImages::RemoteImages(LinkedPair pair, PairLink::KeepWaiting keep_waiting, bool noisy, Grid frame,
                           int channels)
    : pair_(std::move(pair)),
      keep_waiting_(std::move(keep_waiting)),
      noisy_(noisy),
      frame_(frame),
      channels_(channels),
      identity_(identity()) {}

std::string RemoteImages::identity() const {
  const PairLink& link = *pair_.link;
  return fmt::format("{} {} {}", link.fact("pair"), link.fact("layout"), link.fact("scene"));
}

Result<void> RemoteImages::open() {
  if (pair_.link) return {};
  SYMRIG_TRY(pair_.link, PairLink::open(pair_.address, keep_waiting_));
  const std::string now = identity();
  if (now == identity_) return {};
  pair_.link.reset();
  return Error{ErrorCode::size_mismatch,
               fmt::format("{} came back as '{}', it was '{}'", pair_.address.uri.text(), printable_line(now),
                           printable_line(identity_)),
               "start the pair that the capture began with"};
}

Result<CameraFrame> RemoteImages::receive(std::size_t number) {
  PairLink& link = *pair_.link;
  const std::int64_t values = frame_.size() * channels_;
  const std::string wanted = fmt::format("frame {} {}", number, frame_bytes(noisy_, values));
  SYMRIG_TRY(const std::string line, link.receive_line());
  if (line != wanted)
    return Error{ErrorCode::protocol,
                 fmt::format("{} answers '{}' instead of '{}'", link.place(), printable_line(line), wanted),
                 "see docs/pair-protocol.md"};
  CameraFrame frame;
  if (noisy_) {
    frame.raw.resize(static_cast<std::size_t>(values));
    SYMRIG_CHECK(link.receive(std::as_writable_bytes(std::span(frame.raw))));
    return frame;
  }
  Image<float> light(frame_, channels_);
  SYMRIG_CHECK(link.receive(std::as_writable_bytes(light.values())));
  if (!std::ranges::all_of(light.values(), [](float v) { return std::isfinite(v); }))
    return Error{ErrorCode::protocol,
                 fmt::format("{}: frame {} has values that are not finite", link.place(), number),
                 "see docs/pair-protocol.md"};
  frame.attachment = ImageFormation::Light(std::make_shared<const Image<float>>(std::move(light)));
  return frame;
}

Result<void> RemoteImages::develop_some(std::span<const LitPattern> patterns,
                                        std::span<const LitExposure> exposures,
                                        std::vector<CameraFrame>& frames) {
  PairLink& link = *pair_.link;
  SYMRIG_CHECK(link.send(fmt::format("develop {} {}\n", patterns.size(), exposures.size())));
  SYMRIG_CHECK(link.send(encode_develop(patterns, exposures)));
  for (std::size_t k = 1; k <= exposures.size(); ++k) {
    SYMRIG_TRY(CameraFrame frame, receive(k));
    frames.push_back(std::move(frame));
  }
  return {};
}

Result<std::vector<CameraFrame>> RemoteImages::develop(std::span<const LitPattern> patterns,
                                                       std::span<const LitExposure> exposures) {
  if (!pair_.link)
    return Error{ErrorCode::device_lost, fmt::format("{} is not connected", pair_.address.uri.text())};
  std::vector<CameraFrame> frames;
  while (frames.size() < exposures.size()) {
    const Request request = next_request(patterns, exposures.subspan(frames.size()));
    const auto done = develop_some(request.patterns, request.exposures, frames);
    if (done) continue;
    pair_.link.reset();  // whatever comes next belongs to this request
    return done.error();
  }
  return frames;
}

}  // namespace symrig::sim
