// SPDX-License-Identifier: Apache-2.0
#include "calibration/sequence_kind.hpp"
#include "camera/unpack.hpp"
#include "image/codec.hpp"
#include "symrig/base/atomic_file.hpp"
#include "symrig/calibration/capture_file.hpp"
#include "symrig/image/file.hpp"
#include "symrig/image/resample.hpp"

#include <algorithm>

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

/// Replaces each code by its light.
Image<float> linear(Image<float> image, const ResponseCurve& response) {
  const double largest = static_cast<double>(response.light.size()) - 1;
  for (float& value : image.values()) value = static_cast<float>(response(largest * value));
  return image;
}

Result<Image<float>> read_codes(const fs::path& file, const CaptureFile& capture) {
  if (!is_raw(file)) {
    SYMRIG_TRY(auto image, read_image(file));
    return image.channels() == 1 ? std::move(image) : to_gray(image);
  }
  if (!capture.raw)
    return Error{ErrorCode::bad_argument, file.string() + ": a raw file without a description of its format",
                 "add [raw] with format and size to capture.toml"};
  return read_raw(file, *capture.raw);
}

/// The sum of the exposures of one pattern.
class Merged {
 public:
  explicit Merged(Grid grid) : light_(grid, 1), seconds_(grid, 1) {}

  Grid grid() const { return light_.grid(); }
  /// has_codes: 1 is the largest code, so it means saturation.
  void add(const Image<float>& image, bool has_codes, double pedestal, double seconds) {
    for (std::size_t i = 0; i < image.values().size(); ++i) {
      const float value = image.values()[i];
      if (has_codes && value >= 1) continue;
      light_.values()[i] += static_cast<double>(value) - pedestal;
      seconds_.values()[i] += seconds;
    }
  }
  /// The picture that one exposure of `seconds` would give.
  Image<float> at(double seconds) const {
    Image<float> image(light_.grid());
    for (std::size_t i = 0; i < image.values().size(); ++i)
      image.values()[i] = seconds_.values()[i] > 0
                              ? static_cast<float>(light_.values()[i] * seconds / seconds_.values()[i])
                              : 1.0F;
    return image;
  }

 private:
  Image<double> light_, seconds_;
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

Result<Image<float>> read_captured(const fs::path& file, const CaptureFile& capture) {
  SYMRIG_TRY(auto image, read_codes(file, capture));
  if (capture.response && has_codes(file)) return linear(std::move(image), *capture.response);
  return image;
}

Result<CodePhotographs> read_capture(const fs::path& folder, const CaptureFile& capture,
                                     const ReadCodeOptions& options) {
  const GrayCode whole(options.projector.value_or(capture.projector.value_or(Grid{})));
  const NamedPart part = named_part(capture, whole);
  SYMRIG_TRY(const double unit, unit_of(capture));
  CodePhotographs photographs{part.code, {}, {}};
  std::int64_t done = 0;
  for (const int index : part.members(whole)) {
    std::optional<Merged> merged;
    std::string name;
    for (const CapturedPhotograph& p : capture.photographs) {
      if (p.pattern != index) continue;
      SYMRIG_TRY(const auto image, read_captured(folder / p.file, capture));
      if (!merged) merged.emplace(image.grid()), name = p.file;
      if (image.grid() != merged->grid())
        return Error{ErrorCode::size_mismatch,
                     fmt::format("{} is {}; {} is {}", p.file, to_string(image.grid()), name,
                                 to_string(merged->grid())),
                     "use photographs of one camera at one size"};
      merged->add(image, has_codes(p.file), capture.pedestal, seconds_of(p, unit));
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
  }
  if (part.complements) return photographs;
  SYMRIG_CHECK(check_same_size(photographs));
  return calibration::with_derived_complements(part.code, std::move(photographs.images),
                                               std::move(photographs.names));
}

}  // namespace symrig
