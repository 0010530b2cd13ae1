// SPDX-License-Identifier: Apache-2.0
#include "camera/v4l2/formats.hpp"

#include <algorithm>
#include <cerrno>
#include <limits>

#include <fmt/format.h>
#include <linux/videodev2.h>

namespace symrig {

bool SizeOffer::holds(Grid size) const {
  const auto fits = [](int value, int low, int high, int by) {
    return value >= low && value <= high && (value - low) % std::max(by, 1) == 0;
  };
  return fits(size.rows, least.rows, most.rows, step.rows) &&
         fits(size.cols, least.cols, most.cols, step.cols);
}

std::string FormatOffer::name() const {
  if (format != nullptr) return std::string(format->name);
  return fourcc == 0 ? description : fourcc_text(fourcc);
}

}  // namespace symrig

namespace symrig::camera {
namespace {

// Stops an endless list if the driver never ends it.
constexpr std::uint32_t kMostAnswers = 256;

Grid grid(std::uint32_t rows, std::uint32_t cols) {
  return {as_int(rows), as_int(cols)};
}

double rate(const v4l2_fract& interval) {
  return interval.numerator == 0 ? 0 : static_cast<double>(interval.denominator) / interval.numerator;
}

/// Adds the rates of the smallest picture size.
/// fails: device_lost.
Result<void> read_rates(OpenNode& driver, std::uint32_t fourcc, SizeOffer& size) {
  for (std::uint32_t index = 0; index < kMostAnswers; ++index) {
    v4l2_frmivalenum answer{};
    answer.index = index;
    answer.pixel_format = fourcc;
    answer.width = static_cast<std::uint32_t>(size.least.cols);
    answer.height = static_cast<std::uint32_t>(size.least.rows);
    if (const int reason = driver.call(VIDIOC_ENUM_FRAMEINTERVALS, &answer); reason != 0)
      return is_gone(reason) ? Result<void>(driver.error(reason, "reading its frame rates")) : Result<void>();
    const bool single = answer.type == V4L2_FRMIVAL_TYPE_DISCRETE;
    const double slow = rate(single ? answer.discrete : answer.stepwise.max);
    const double fast = rate(single ? answer.discrete : answer.stepwise.min);
    size.slowest = index == 0 ? slow : std::min(size.slowest, slow);
    size.fastest = std::max(size.fastest, fast);
    if (!single) return {};
  }
  return {};
}

SizeOffer to_offer(const v4l2_frmsizeenum& answer) {
  if (answer.type == V4L2_FRMSIZE_TYPE_DISCRETE) {
    const Grid size = grid(answer.discrete.height, answer.discrete.width);
    return {size, size};
  }
  const v4l2_frmsize_stepwise& range = answer.stepwise;
  return {grid(range.min_height, range.min_width), grid(range.max_height, range.max_width),
          grid(range.step_height, range.step_width)};
}

Result<std::vector<SizeOffer>> read_sizes(OpenNode& driver, std::uint32_t fourcc) {
  std::vector<SizeOffer> sizes;
  for (std::uint32_t index = 0; index < kMostAnswers; ++index) {
    v4l2_frmsizeenum answer{};
    answer.index = index;
    answer.pixel_format = fourcc;
    if (const int reason = driver.call(VIDIOC_ENUM_FRAMESIZES, &answer); reason != 0) {
      if (is_gone(reason)) return driver.error(reason, "reading its sizes");
      break;
    }
    sizes.push_back(to_offer(answer));
    SYMRIG_CHECK(read_rates(driver, fourcc, sizes.back()));
    if (answer.type != V4L2_FRMSIZE_TYPE_DISCRETE) break;
  }
  return sizes;
}

std::string description_of(const v4l2_fmtdesc& answer) {
  const auto* const begin = std::begin(answer.description);
  return {begin, std::find(begin, std::end(answer.description), std::uint8_t{0})};
}

}  // namespace

Result<std::vector<FormatOffer>> read_capabilities(OpenNode& driver) {
  std::vector<FormatOffer> offers;
  for (std::uint32_t index = 0; index < kMostAnswers; ++index) {
    v4l2_fmtdesc answer{};
    answer.index = index;
    answer.type = driver.buffer_type();
    if (const int reason = driver.call(VIDIOC_ENUM_FMT, &answer); reason != 0) {
      if (is_gone(reason)) return driver.error(reason, "reading its formats");
      break;
    }
    FormatOffer offer{answer.pixelformat, description_of(answer), find_pixel_format(answer.pixelformat), {}};
    SYMRIG_TRY(offer.sizes, read_sizes(driver, answer.pixelformat));
    offers.push_back(std::move(offer));
  }
  return offers;
}

std::string size_text(const SizeOffer& size) {
  if (size.single()) return to_string(size.least);
  return fmt::format("{} to {}", to_string(size.least), to_string(size.most));
}

std::string capabilities_text(const std::vector<FormatOffer>& offers) {
  std::string text;
  for (const FormatOffer& offer : offers) {
    if (offer.format == nullptr) continue;
    std::string sizes;
    for (const SizeOffer& size : offer.sizes) sizes += (sizes.empty() ? "" : ", ") + size_text(size);
    text += (text.empty() ? "" : ", ") + offer.name() + (sizes.empty() ? "" : " (" + sizes + ")");
  }
  return text.empty() ? "no format that symrig can read" : text;
}

}  // namespace symrig::camera
