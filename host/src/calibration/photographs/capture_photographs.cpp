// SPDX-License-Identifier: Apache-2.0
#include "calibration/photographs/captured.hpp"
#include "calibration/sequence/sequence_verdicts.hpp"
#include "symrig/base/files.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/calibration/capture_file.hpp"
#include "symrig/camera/internal/frame_reader.hpp"
#include "symrig/hdr/internal/clipping.hpp"
#include "symrig/image/file.hpp"
#include "symrig/image/image.hpp"
#include "symrig/image/internal/codec.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig {
namespace {

namespace fs = std::filesystem;

/// The depth of a sample: its significant bits and the unused bits below them.
camera::SampleDepth depth_of(const RawLayout& raw) {
  const PixelFormat& format = *raw.format;
  const int bits = raw.bits > 0 ? raw.bits : format.bits;
  const bool words = format.packing == Packing::words || format.packing == Packing::words_high_first;
  return {bits, words && raw.high_justified ? 16 - bits : format.shift};
}

Result<Image<float>> read_raw(const fs::path& file, const RawLayout& raw) {
  const std::size_t rows = raw.size.rows;
  const std::size_t whole = raw.stride * rows;
  const std::size_t least = raw.stride * (rows - 1) + row_bytes(*raw.format, raw.size.cols);
  SYMRIG_TRY(const auto bytes, read_file(file, std::max<std::uint64_t>(whole, std::uint64_t{1} << 31)));
  if (bytes.size() < least || bytes.size() > whole)
    return Error{ErrorCode::bad_format,
                 fmt::format("{}: has {} bytes; {} rows of {} bytes are {}", file.string(), bytes.size(),
                             rows, raw.stride, whole),
                 "check format, size and stride of [raw] in capture.toml"};
  const camera::SampleDepth depth = depth_of(raw);
  const auto largest = static_cast<float>((1U << depth.bits) - 1);
  Image<float> image(raw.size);
  std::vector<std::uint16_t> codes(raw.size.cols);
  for (int row = 0; row < raw.size.rows; ++row) {
    const auto at = raw.stride * static_cast<std::size_t>(row);
    camera::unpack(raw.format->packing, depth,
                   std::span(bytes).subspan(at, std::min(raw.stride, bytes.size() - at)), codes);
    for (int col = 0; col < raw.size.cols; ++col)
      image.at(row, col) = static_cast<float>(codes[col]) / largest;
  }
  return image;
}

bool is_raw(const fs::path& file) {
  return image::lower_suffix(file) == ".raw";
}

/// Whether values are codes. EXR and PFM contain radiance, which has no largest code.
bool has_codes(const fs::path& file) {
  const std::string suffix = image::lower_suffix(file);
  return suffix != ".exr" && suffix != ".pfm";
}

/// The largest code of the word that a picture's code is stored in, if [sensor] states the bits of a code.
std::optional<double> stored_largest(const fs::path& file, const CaptureFile& capture) {
  if (is_raw(file) || !has_codes(file) || !capture.sensor || capture.sensor->bits == 0) return {};
  return capture.sensor->bits <= 8 ? 255.0 : 65535.0;
}

/// Replaces each code by its light. largest: the code of value 1.
void make_linear(Image<float>& image, const ResponseCurve& response, double largest) {
  for (float& value : image.values())
    value = static_cast<float>(response(largest * static_cast<double>(value)));
}

Image<float> brightest_channel(const Image<float>& image) {
  Image<float> peak(image.grid());
  for (int channel = 0; channel < image.channels(); ++channel)
    std::ranges::transform(image.plane(channel), peak.values(), peak.values().begin(),
                           [](float a, float b) { return std::max(a, b); });
  return peak;
}

Result<calibration::Captured> read_codes(const fs::path& file, const CaptureFile& capture) {
  if (!is_raw(file)) {
    SYMRIG_TRY(auto image, read_image(file));
    if (image.channels() == 1) return calibration::Captured{std::move(image), {}};
    return calibration::Captured{to_gray(image), has_codes(file) ? brightest_channel(image) : Image<float>()};
  }
  if (!capture.raw)
    return Error{ErrorCode::bad_argument, file.string() + ": a raw file without a description of its format",
                 "add [raw] with format and size to capture.toml"};
  SYMRIG_TRY(auto image, read_raw(file, *capture.raw));
  return calibration::Captured{std::move(image), {}};
}

/// The value of the largest code of a file.
Result<float> saturation_of(const fs::path& file, const CaptureFile& capture, const Image<float>& codes) {
  if (!has_codes(file)) return std::numeric_limits<float>::infinity();
  const auto stored = stored_largest(file, capture);
  if (!stored) return 1.0F;
  const int bits = capture.sensor->bits;
  const double own = std::ldexp(1.0, bits) - 1, most = *stored * std::ranges::max(codes.values());
  if (most < own + 0.5) return static_cast<float>(own / *stored);
  return Error{ErrorCode::bad_value,
               fmt::format("{}: code {:.0f} does not fit in {} bits", file.string(), most, bits),
               "correct the bits of [sensor] in capture.toml; codes use the low bits of a 16-bit picture"};
}

/// The sum of the exposures of one pattern.
class Merged {
 public:
  explicit Merged(Grid grid) : light_(grid, 1), seconds_(grid, 1) {}

  Grid grid() const { return light_.grid(); }
  /// Leaves out what is saturated.
  void add(calibration::Captured picture, float saturation, double pedestal, double seconds) {
    const auto brightest = picture.brightest().values();
    for (std::size_t i = 0; i < brightest.size(); ++i) {
      if (brightest[i] >= saturation * kRounding) continue;
      light_.values()[i] += static_cast<double>(picture.light.values()[i]) - pedestal;
      seconds_.values()[i] += seconds;
    }
    if (seconds < shortest_) shortest_ = seconds, of_shortest_ = std::move(picture);
  }
  /// The picture that one exposure of `seconds` would give. A pixel that is saturated in all exposures keeps
  /// the value of the shortest one.
  Image<float> at(double seconds) const {
    Image<float> image = of_shortest_.light;
    for (std::size_t i = 0; i < image.values().size(); ++i)
      if (seconds_.values()[i] > 0)
        image.values()[i] = static_cast<float>(light_.values()[i] * seconds / seconds_.values()[i]);
    return image;
  }
  /// The brightest channel of the shortest exposure in colours; else empty.
  Image<float> peak() && { return std::move(of_shortest_.peak); }

 private:
  static constexpr float kRounding = 1 - 1e-6F;

  Image<double> light_, seconds_;
  calibration::Captured of_shortest_;
  double shortest_ = std::numeric_limits<double>::infinity();
};

/// The shortest exposure in seconds; 1 if none is given.
Result<double> unit_of(const CaptureFile& capture) {
  const auto has_exposure = [](const CapturedPhotograph& p) { return p.exposure.count() > 0; };
  if (std::ranges::none_of(capture.photographs, has_exposure)) return 1.0;
  const auto missing = std::ranges::find_if_not(capture.photographs, has_exposure);
  if (missing != capture.photographs.end())
    return Error{ErrorCode::bad_value,
                 fmt::format("{}:{}: {} has no exposure time, but other photographs have one", capture.path,
                             missing->line, missing->file),
                 "give exposure = \"20 ms\" at the top, or for every photograph"};
  const auto shortest = std::ranges::min(capture.photographs, {}, &CapturedPhotograph::exposure).exposure;
  return std::chrono::duration<double>(shortest).count();
}

double seconds_of(const CapturedPhotograph& photograph, double unit) {
  return photograph.exposure.count() > 0 ? std::chrono::duration<double>(photograph.exposure).count() : unit;
}

/// The name of a pattern by its index, such as "columns 3 complement".
std::string pattern_name(const GrayCode& code, int index) {
  if (index >= code.white()) return index == code.white() ? "white" : "black";
  const StripePair pair = code.pair(index / 2);
  return fmt::format("{} {}{}", pair.axis == StripeAxis::columns ? "columns" : "rows", pair.bit,
                     index % 2 ? " complement" : "");
}

/// The part of a projector's sequence that the names of a capture belong to. A sequence without complements
/// names none, and one of a single axis no pattern of the other.
struct NamedPart {
  GrayCode code;
  bool complements = true;

  /// The index in the projector's whole sequence of each photograph that must be there, in order.
  std::vector<int> members(const GrayCode& whole) const {
    std::vector<int> all;
    for (int index = 0; index < whole.photographs(); ++index) {
      const bool pattern = index < whole.white();
      if (pattern && code.bits(whole.pair(index / 2).axis) == 0) continue;
      if (pattern && !complements && index % 2 != 0) continue;
      all.push_back(index);
    }
    return all;
  }
};

NamedPart named_part(const CaptureFile& capture, const GrayCode& whole) {
  const auto names = [&](auto which) {
    return std::ranges::any_of(capture.photographs, [&](const CapturedPhotograph& p) {
      return p.pattern < whole.white() && which(p.pattern);
    });
  };
  const bool columns = names([&](int k) { return k / 2 < whole.column_bits(); }),
             rows = names([&](int k) { return k / 2 >= whole.column_bits(); });
  const CodeAxes axes = columns == rows ? CodeAxes::both : columns ? CodeAxes::columns : CodeAxes::rows;
  // If it names no pattern at all, the first one is missing.
  return {GrayCode(whole.projector(), axes), names([](int k) { return k % 2 != 0; }) || !(columns || rows)};
}

}  // namespace

namespace calibration {

Result<Captured> read_captured_codes(const fs::path& file, const CaptureFile& capture) {
  SYMRIG_TRY(Captured read, read_codes(file, capture));
  SYMRIG_TRY(read.saturation, saturation_of(file, capture, read.brightest()));
  if (!capture.response || !has_codes(file)) return read;
  const double largest =
      stored_largest(file, capture).value_or(static_cast<double>(capture.response->light.size()) - 1);
  make_linear(read.light, *capture.response, largest);
  make_linear(read.peak, *capture.response, largest);
  read.saturation = 1;
  return read;
}

std::optional<float> value_that_light_piles_up_at(const Captured& shorter, const Captured& longer,
                                                  double ratio, double pedestal) {
  constexpr double kBrightest = 0.998;  // stuck pixels may be brighter
  constexpr double kBeyond = 1.3, kWithin = 0.0025, kMost = 0.9, kFewestFull = 0.005;
  const auto dim = shorter.brightest().values(), bright = longer.brightest().values();
  std::vector<float> sorted(bright.begin(), bright.end());
  const float top = quantile(sorted, kBrightest);
  const auto full = static_cast<double>(std::ranges::count(bright, top));
  if (largest_code_at(top) && full > kFewestFull * static_cast<double>(bright.size())) return top;
  std::vector<double> beyond;
  for (std::size_t i = 0; i < dim.size(); ++i)
    if ((static_cast<double>(dim[i]) - pedestal) * ratio + pedestal > kBeyond * static_cast<double>(top))
      beyond.push_back(static_cast<double>(bright[i]));
  const auto pile = hdr::piled_up(std::move(beyond), kWithin * static_cast<double>(top), kMost);
  return pile ? std::optional(static_cast<float>(*pile)) : std::nullopt;
}

}  // namespace calibration

Result<Image<float>> read_captured(const fs::path& file, const CaptureFile& capture) {
  SYMRIG_TRY(calibration::Captured read, calibration::read_captured_codes(file, capture));
  return std::move(read.light);
}

namespace {

/// The value of a saturated pixel, by white's exposures: what the largest code states, or less if the longer
/// ones stay below it.
Result<float> saturation_of_white(const fs::path& folder, const CaptureFile& capture, int white) {
  std::vector<CapturedPhotograph> exposures;
  std::ranges::copy_if(capture.photographs, std::back_inserter(exposures),
                       [&](const CapturedPhotograph& p) { return p.pattern == white; });
  std::ranges::stable_sort(exposures, {}, &CapturedPhotograph::exposure);
  float least = std::numeric_limits<float>::infinity();
  std::optional<calibration::Captured> before;
  for (std::size_t k = 0; k < exposures.size(); ++k) {
    SYMRIG_TRY(auto picture, calibration::read_captured_codes(folder / exposures[k].file, capture));
    least = std::min(least, picture.saturation);
    const bool of_codes = std::isfinite(picture.saturation);
    if (before && of_codes && before->light.grid() == picture.light.grid() &&
        exposures[k - 1].exposure.count() > 0) {
      const double ratio = seconds_of(exposures[k], 1) / seconds_of(exposures[k - 1], 1);
      const auto pile = calibration::value_that_light_piles_up_at(*before, picture, ratio, capture.pedestal);
      least = std::min(least, pile.value_or(least));
    }
    before = std::move(picture);
  }
  return least;
}

}  // namespace

Result<CodePhotographs> read_capture(const fs::path& folder, const CaptureFile& capture,
                                     const ReadCodeOptions& options) {
  const GrayCode whole(options.projector.value_or(capture.projector.value_or(Grid{})));
  const NamedPart part = named_part(capture, whole);
  SYMRIG_TRY(const double unit, unit_of(capture));
  SYMRIG_TRY(const float saturation, saturation_of_white(folder, capture, whole.white()));
  CodePhotographs photographs{part.code, {}, {}};
  photographs.saturation = saturation;
  std::int64_t done = 0;
  for (const int index : part.members(whole)) {
    std::optional<Merged> merged;
    std::string name;
    for (const CapturedPhotograph& p : capture.photographs) {
      if (p.pattern != index) continue;
      SYMRIG_TRY(auto picture, calibration::read_captured_codes(folder / p.file, capture));
      const Grid grid = picture.light.grid();
      if (!merged) merged.emplace(grid), name = p.file;
      if (grid != merged->grid())
        return Error{
            ErrorCode::size_mismatch,
            fmt::format("{} is {}; {} is {}", p.file, to_string(grid), name, to_string(merged->grid())),
            "use photographs of one camera at one size"};
      merged->add(std::move(picture), saturation, capture.pedestal, seconds_of(p, unit));
      if (options.progress &&
          !options.progress({"reading", ++done, static_cast<std::int64_t>(capture.photographs.size())}))
        return Error{ErrorCode::interrupted, "reading of " + folder.string() + " was stopped"};
    }
    if (!merged)
      return Error{
          ErrorCode::bad_value,
          fmt::format("{}: no photograph of \"{}\"", capture.path, pattern_name(whole, index)),
          "photograph it: a sequence needs every pattern of an axis, all complements or none, white and "
          "black"};
    photographs.images.push_back(merged->at(unit));
    photographs.names.push_back(std::move(name));
    if (index == whole.white()) photographs.white_peak = std::move(*merged).peak();
  }
  if (part.complements) return photographs;
  SYMRIG_CHECK(check_same_size(photographs));
  CodePhotographs all = calibration::with_derived_complements(part.code, std::move(photographs.images),
                                                              std::move(photographs.names));
  all.saturation = saturation;
  all.white_peak = std::move(photographs.white_peak);
  return all;
}

}  // namespace symrig
