// SPDX-License-Identifier: Apache-2.0

#include "camera/v4l2/open_node.hpp"
#include "symrig/base/text.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
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

namespace {

using Offers = std::vector<FormatOffer>;

Error refused(const OpenNode& driver, const std::string& what, const Offers& offers) {
  return {ErrorCode::device_refused, fmt::format("camera {}: {}", driver.path(), what),
          "it offers " + capabilities_text(offers)};
}

Error no_format(std::string_view name) {
  std::vector<std::string_view> names;
  for (const PixelFormat& format : pixel_formats()) names.push_back(format.name);
  return {ErrorCode::unknown_name, fmt::format("no pixel format is called '{}'", name),
          nearest_hint(name, names)};
}

bool offered(const Offers& offers, const PixelFormat& format) {
  return std::any_of(offers.begin(), offers.end(),
                     [&](const FormatOffer& offer) { return offer.fourcc == format.fourcc; });
}

/// The format that the settings name. Without a name: the first linear format in our order of preference.
Result<const PixelFormat*> choose_format(const OpenNode& driver, std::string_view name,
                                         const Offers& offers) {
  if (!name.empty()) {
    const PixelFormat* const format = find_pixel_format(name);
    if (format == nullptr) return no_format(name);
    if (!offered(offers, *format)) return refused(driver, fmt::format("it has no format {}", name), offers);
    return format;
  }
  for (const PixelFormat& format : pixel_formats())
    if (format.linear && offered(offers, format)) return &format;
  return refused(driver, "it has no linear format that symrig can read", offers);
}

Result<SampleDepth> sample_depth(const PixelFormat& format, const CameraSettings& settings) {
  if (settings.bits == 0 || settings.bits == format.bits) return SampleDepth{format.bits, format.shift};
  const bool words = format.packing == Packing::words || format.packing == Packing::words_high_first;
  if (!words || format.bits != 16)
    return Error{
        ErrorCode::bad_argument,
        fmt::format("the settings say {} bits for {}, which has {}", settings.bits, format.name, format.bits),
        "remove the bits: only a 16-bit format may hold fewer"};
  if (settings.bits < 8 || settings.bits > 16)
    return Error{ErrorCode::bad_argument, fmt::format("{} significant bits is out of range", settings.bits),
                 "give 8 to 16"};
  return SampleDepth{settings.bits, settings.justified == Justified::high ? 16 - settings.bits : 0};
}

std::string as_asked(const PixelFormat& format, Grid size) {
  return fmt::format("{} {}", format.name, to_string(size));
}

/// Checks that the driver's format is the requested one, and that it is possible.
Result<PictureLayout> accept(const OpenNode& driver, const PixelFormat& format, Grid size, DriverFormat got,
                             const Offers& offers) {
  if (got.fourcc != format.fourcc || got.size != size)
    return refused(driver,
                   fmt::format("it was asked for {}, but the driver set {} {}", as_asked(format, size),
                               fourcc_text(got.fourcc), to_string(got.size)),
                   offers);
  if (!size.valid()) return refused(driver, fmt::format("{} is not a picture size", to_string(size)), offers);
  if (got.interlaced) return refused(driver, "it gives interlaced pictures", offers);
  if (got.planes != 1)
    return refused(driver, fmt::format("it gives {} in {} planes", format.name, got.planes), offers);
  const std::size_t row = row_bytes(format, size.cols);
  const PictureLayout layout{&format, {}, size, got.stride == 0 ? row : got.stride};
  if (layout.stride < row)
    return refused(driver,
                   fmt::format("the driver reports {} bytes per row, but {} needs {}", layout.stride,
                               as_asked(format, size), row),
                   offers);
  if (got.bytes < layout.bytes())
    return refused(driver,
                   fmt::format("the driver reports {} bytes per picture, but {} needs {}", got.bytes,
                               as_asked(format, size), layout.bytes()),
                   offers);
  return layout;
}

double rate_of(const v4l2_streamparm& parameters) {
  const v4l2_fract& interval = parameters.parm.capture.timeperframe;
  return interval.numerator == 0 ? 0 : static_cast<double>(interval.denominator) / interval.numerator;
}

Result<void> set_rate(OpenNode& driver, double rate, const Offers& offers) {
  if (rate == 0) return {};
  if (!(rate > 0) || rate > 1e6)
    return Error{ErrorCode::bad_argument, fmt::format("{} pictures a second is out of range", rate),
                 "give a rate above 0, up to 1e6"};
  v4l2_streamparm parameters{};
  parameters.type = driver.buffer_type();
  parameters.parm.capture.timeperframe = {1000, static_cast<std::uint32_t>(std::lround(1000 * rate))};
  SYMRIG_CHECK(driver.ask(VIDIOC_S_PARM, &parameters, fmt::format("setting {} pictures a second", rate)));
  const double got = rate_of(parameters);
  if (std::abs(got - rate) <= 0.01 * rate) return {};
  return refused(
      driver, fmt::format("{} pictures a second requested, but the driver gives {:.6g}", rate, got), offers);
}

}  // namespace

Result<PictureLayout> negotiate(OpenNode& driver, const CameraSettings& settings) {
  SYMRIG_TRY(const Offers offers, read_capabilities(driver));
  SYMRIG_TRY(const PixelFormat* const format, choose_format(driver, settings.format, offers));
  SYMRIG_TRY(const SampleDepth depth, sample_depth(*format, settings));
  Grid size = settings.size;
  if (size == Grid{}) {
    SYMRIG_TRY(const DriverFormat now, driver.format());
    size = now.size;
  }
  SYMRIG_TRY(const DriverFormat got, driver.set_format(format->fourcc, size));
  SYMRIG_TRY(PictureLayout layout, accept(driver, *format, size, got, offers));
  layout.depth = depth;
  SYMRIG_CHECK(set_rate(driver, settings.rate, offers));
  return layout;
}

}  // namespace symrig::camera
