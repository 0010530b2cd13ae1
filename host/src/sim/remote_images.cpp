// SPDX-License-Identifier: Apache-2.0
#include "sim/remote_images.hpp"

#include "sim/pair_request.hpp"
#include "symrig/base/text.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <fmt/format.h>

namespace symrig::sim {
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
