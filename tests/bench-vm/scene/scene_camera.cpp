// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/scene_camera.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig::bench_vm {

namespace {

void put(std::vector<std::uint8_t>& bytes, std::size_t pixel, std::uint16_t code) {
  bytes[2 * pixel] = static_cast<std::uint8_t>(code & 0xffU);
  bytes[2 * pixel + 1] = static_cast<std::uint8_t>(code >> 8U);
}

}  // namespace

Result<void> CameraPicture::check() const {
  if (top >= 0 && left >= 0 && top + camera.rows <= picture.rows && left + camera.cols <= picture.cols)
    return {};
  return Error{ErrorCode::size_mismatch,
               fmt::format("a camera of {} at row {}, column {} is not inside a picture of {}",
                           to_string(camera), top, left, to_string(picture)),
               "give a larger --picture"};
}

std::vector<std::uint8_t> CameraPicture::bytes(std::span<const std::uint16_t> codes) const {
  const std::size_t pixels = picture.size();
  std::vector<std::uint8_t> bytes(2 * pixels);
  for (std::size_t i = 0; i < pixels; ++i) put(bytes, i, dark);
  std::size_t i = 0;
  for (int row = 0; row < camera.rows; ++row)
    for (int col = 0; col < camera.cols; ++col)
      put(bytes, static_cast<std::size_t>(top + row) * picture.cols + left + col, codes[i++]);
  return bytes;
}

namespace {

class V4l2SceneCamera final : public SceneCamera {
 public:
  V4l2SceneCamera(CameraPort port, const CameraPicture& picture)
      : port_(std::move(port)), picture_(picture) {}

  Result<Settings> settings() const override {
    SYMRIG_TRY(const CameraState state, port_.state());
    if (state.streaming && !state.is_y12)
      return Error{ErrorCode::bad_format, "the host has set a format other than Y12",
                   "give format = \"Y12\" in the rig file"};
    return Settings{state.follows_pulse, state.stamps_begin};
  }
  Result<CameraPort::Taken> deliver(const DeliveredFrame& frame) override {
    return port_.deliver({frame.stamp, frame.skip, frame.damaged}, picture_.bytes(*frame.codes));
  }
  Result<void> plug(bool in) override { return port_.plug(in); }

 private:
  CameraPort port_;
  CameraPicture picture_;
};

}  // namespace

Result<std::unique_ptr<SceneCamera>> open_v4l2_camera(const CameraPicture& picture) {
  SYMRIG_CHECK(picture.check());
  SYMRIG_TRY(const std::string path, bench_variable("BENCH_CAMERA_INJECT"));
  SYMRIG_TRY(CameraPort port, CameraPort::open(path));
  return std::unique_ptr<SceneCamera>(std::make_unique<V4l2SceneCamera>(std::move(port), picture));
}

namespace {

/// Columns [first, first + each.cols) of a frame of two halves.
Codes half_of(const std::vector<std::uint16_t>& codes, Grid each, std::size_t first) {
  const std::size_t cols = each.cols;
  auto half = std::make_shared<std::vector<std::uint16_t>>(each.size());
  for (std::size_t row = 0; row < static_cast<std::size_t>(each.rows); ++row)
    std::copy_n(codes.begin() + static_cast<std::ptrdiff_t>(2 * row * cols + first), cols,
                half->begin() + static_cast<std::ptrdiff_t>(row * cols));
  return half;
}

class PairedCamera final : public SceneCamera {
 public:
  PairedCamera(std::unique_ptr<SceneCamera> left, std::unique_ptr<SceneCamera> right, Grid each,
               std::optional<std::uint64_t> lost)
      : left_(std::move(left)), right_(std::move(right)), each_(each), lost_(lost) {}

  Result<Settings> settings() const override {
    SYMRIG_TRY(const Settings left, left_->settings());
    SYMRIG_TRY(const Settings right, right_->settings());
    return Settings{left.follows_pulse && right.follows_pulse, left.stamps_begin};
  }

  Result<CameraPort::Taken> deliver(const DeliveredFrame& frame) override {
    DeliveredFrame part = frame;
    part.codes = half_of(*frame.codes, each_, 0);
    SYMRIG_TRY(const CameraPort::Taken left, left_->deliver(part));
    if (frame.frame == lost_) {
      ++skipped_;
      return left;
    }
    SYMRIG_TRY(const Settings settings, left_->settings());
    SYMRIG_TRY(const Settings of_right, right_->settings());
    if (settings.stamps_begin && !of_right.stamps_begin) part.stamp += frame.open;
    part.skip += std::exchange(skipped_, 0);
    part.codes = half_of(*frame.codes, each_, each_.cols);
    SYMRIG_TRY(const CameraPort::Taken right, right_->deliver(part));
    return left != CameraPort::Taken::yes ? left : right;
  }

  Result<void> plug(bool in) override {
    SYMRIG_CHECK(left_->plug(in));
    return right_->plug(in);
  }

  std::string report() const override {
    const std::array<std::string, 2> reports{left_->report(), right_->report()};
    return reports[0].empty() ? reports[1] : fmt::format("{}; {}", reports[0], reports[1]);
  }

 private:
  std::unique_ptr<SceneCamera> left_, right_;
  Grid each_;
  std::optional<std::uint64_t> lost_;
  std::uint32_t skipped_ = 0;  // frames that the right camera has lost since its last one
};

}  // namespace

std::unique_ptr<SceneCamera> pair_cameras(std::unique_ptr<SceneCamera> left,
                                          std::unique_ptr<SceneCamera> right, Grid each,
                                          std::optional<std::uint64_t> lost) {
  return std::make_unique<PairedCamera>(std::move(left), std::move(right), each, lost);
}

}  // namespace symrig::bench_vm
