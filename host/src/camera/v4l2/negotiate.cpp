// SPDX-License-Identifier: Apache-2.0
#include "camera/v4l2/formats.hpp"
#include "symrig/base/text.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <linux/videodev2.h>

namespace symrig::camera {
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
