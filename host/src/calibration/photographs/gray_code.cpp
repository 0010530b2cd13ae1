// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/gray_code.hpp"

#include "calibration/photographs/captured.hpp"
#include "calibration/sequence/sequence_causes.hpp"
#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace symrig {
namespace {

/// The number of bits that distinguish `positions` positions.
int bits_for(int positions) {
  return std::bit_width(static_cast<unsigned>(std::max(positions, 1) - 1));
}

/// Whether the mean light is the same in all photographs, to a hundredth: patterns have half of white's.
bool are_all_alike(const CodePhotographs& photographs) {
  constexpr double kAlike = 0.01;
  double least = 1e300, most = -1e300;
  for (const Image<float>& image : photographs.images) {
    const double light = calibration::mean_light(image);
    least = std::min(least, light), most = std::max(most, light);
  }
  return most - least <= kAlike * std::abs(most);
}

/// Whether neighbours are a pattern and its complement: their sum is white + black. Without complements the
/// rms difference is about 0.7 of white − black, as half of the neighbours are both lit or both dark.
bool neighbours_add_up(const std::vector<Image<float>>& images) {
  constexpr double kMost = 0.35;
  constexpr std::size_t kSample = 5'000;
  const auto white = (images.end() - 2)->values(), black = images.back().values();
  const std::size_t stride = white.size() / kSample + 1;
  std::vector<double> apart;
  for (std::size_t k = 0; k + 3 < images.size(); k += 2) {
    const auto pattern = images[k].values(), complement = images[k + 1].values();
    double squares = 0, light = 0;
    for (std::size_t i = 0; i < white.size(); i += stride) {
      squares += std::pow(static_cast<double>(pattern[i] + complement[i] - white[i] - black[i]), 2);
      light += std::pow(static_cast<double>(white[i] - black[i]), 2);
    }
    apart.push_back(light > 0 ? std::sqrt(squares / light) : 0);
  }
  return median(apart) < kMost;
}

bool all_alike(const std::vector<Image<float>>& images) {
  return std::ranges::all_of(images, [&](const Image<float>& image) {
    return image.grid() == images.front().grid() && image.channels() == images.front().channels();
  });
}

}  // namespace

GrayCode::GrayCode(Grid projector, CodeAxes axes)
    : projector_(projector),
      column_bits_(axes == CodeAxes::rows ? 0 : bits_for(projector.cols)),
      row_bits_(axes == CodeAxes::columns ? 0 : bits_for(projector.rows)) {}

std::optional<GrayCode> GrayCode::of_length(int photographs) {
  const int pairs = (photographs - 2) / 2;
  if (photographs % 2 != 0 || pairs < 2 || pairs > 30) return std::nullopt;
  if (pairs == 20) return GrayCode({768, 1024});
  if (pairs == 21) return GrayCode({800, 1280});
  if (pairs == 22) return GrayCode({1080, 1920});
  return GrayCode({1 << (pairs / 2), 1 << ((pairs + 1) / 2)});
}

StripePair GrayCode::pair(int index) const {
  const bool columns = index < column_bits_;
  const int bit = columns ? index : index - column_bits_;
  const int all = columns ? column_bits_ : row_bits_;
  // Bit 0 has one edge, in the middle; bit k ≥ 1 changes every 2^(bits−k) positions.
  const int width = 1 << (bit == 0 ? all - 1 : all - bit);
  return {columns ? StripeAxis::columns : StripeAxis::rows, bit, width,
          fmt::format("{}, {} px", columns ? "columns" : "rows", width)};
}

bool GrayCode::lit(int pair, int position) const {
  const bool columns = pair < column_bits_;
  const int from_least = columns ? column_bits_ - 1 - pair : pairs() - 1 - pair;
  const auto x = static_cast<unsigned>(position);
  return ((x ^ (x >> 1)) >> from_least & 1U) != 0;
}

Pattern GrayCode::pattern(int index) const {
  Pattern pattern(projector_, 1, index == white() ? 1.0F : 0.0F);
  if (index >= white()) return pattern;
  const bool columns = index / 2 < column_bits_, complement = index % 2 != 0;
  for (int row = 0; row < projector_.rows; ++row)
    for (int col = 0; col < projector_.cols; ++col)
      pattern.at(row, col) = lit(index / 2, columns ? col : row) != complement ? 1.0F : 0.0F;
  return pattern;
}

std::vector<Pattern> gray_code_patterns(Grid projector) {
  const GrayCode code(projector);
  std::vector<Pattern> patterns;
  patterns.reserve(code.photographs());
  for (int i = 0; i < code.photographs(); ++i) patterns.push_back(code.pattern(i));
  return patterns;
}

Result<void> check_gray_code(const CodePhotographs& photographs) {
  if (static_cast<int>(photographs.images.size()) != photographs.code.photographs())
    return Error{ErrorCode::size_mismatch,
                 fmt::format("{} photographs; a projector of {} needs {}", photographs.images.size(),
                             to_string(photographs.code.projector()), photographs.code.photographs())};
  SYMRIG_CHECK(check_same_size(photographs));
  const auto name = [&](int i) { return photographs.names[i]; };
  if (calibration::mean_light(photographs.white()) > calibration::mean_light(photographs.black())) return {};
  const auto causes =
      calibration::find_arrangements(photographs, calibration::find_clear_pixels(photographs));
  if (!causes.empty()) return calibration::error_of(causes);
  const std::string seen = fmt::format("white ({}) is not brighter than black ({})",
                                       name(photographs.code.white()), name(photographs.code.black()));
  if (are_all_alike(photographs))
    return Error{ErrorCode::bad_value,
                 seen + ", and no photograph is brighter than another: the camera does not see the projector",
                 "check lamp, lens cap, shutter and exposure"};
  std::vector<double> light;
  for (int k = 0; k < photographs.code.photographs(); ++k)
    if (!photographs.complements_derived || k % 2 == 0 || k > photographs.code.white())
      light.push_back(calibration::mean_light(photographs.image(k)));
  const auto [darkest, brightest] = std::ranges::minmax_element(light);
  const char* const order = "the order is: column pairs, row pairs, white, black";
  if (brightest != std::prev(light.end())) return Error{ErrorCode::bad_value, seen, order};
  if (darkest == std::prev(light.end(), 2))
    return Error{ErrorCode::bad_value,
                 seen + ": the two are exchanged, or the projector shows black for white in all patterns",
                 order};
  return Error{
      ErrorCode::bad_value,
      fmt::format(
          "{}: {} is the brightest of all, so the photographs are one late, or other light was on in it",
          seen, name(photographs.code.black())),
      order};
}

Result<void> check_same_size(const CodePhotographs& photographs) {
  for (std::size_t i = 0; i < photographs.images.size(); ++i) {
    const auto& image = photographs.images[i];
    if (image.grid() == photographs.camera() && image.channels() == 1) continue;
    return Error{ErrorCode::size_mismatch,
                 fmt::format("{} is {}; {} is {}", photographs.names[i], to_string(image.grid()),
                             photographs.names.front(), to_string(photographs.camera())),
                 "all photographs of a sequence come from one camera at one size"};
  }
  return {};
}

namespace calibration {

std::vector<int> legal_lengths(Grid projector) {
  const GrayCode both(projector), columns(projector, CodeAxes::columns);
  std::vector<int> lengths{both.photographs(), both.pairs() + 2};
  if (columns.pairs() > 0 && both.row_bits() > 0)
    lengths.push_back(columns.photographs()), lengths.push_back(columns.pairs() + 2);
  return lengths;
}

CodePhotographs with_derived_complements(const GrayCode& code, std::vector<Image<float>> images,
                                         std::vector<std::string> names) {
  CodePhotographs all{code, {}, {}};
  all.complements_derived = true;
  const std::size_t patterns = images.size() - 2;
  for (std::size_t k = 0; k < patterns; ++k) {
    Image<float> complement = images[patterns];
    for (std::size_t i = 0; i < complement.values().size(); ++i)
      complement.values()[i] += images[patterns + 1].values()[i] - images[k].values()[i];
    all.names.push_back(names[k]);
    all.names.push_back(names[k] + " inverted");
    all.images.push_back(std::move(images[k]));
    all.images.push_back(std::move(complement));
  }
  for (std::size_t k = patterns; k < images.size(); ++k) {
    all.names.push_back(std::move(names[k]));
    all.images.push_back(std::move(images[k]));
  }
  return all;
}

}  // namespace calibration

Result<CodePhotographs> arrange_code_photographs(Grid projector, std::vector<Image<float>> images,
                                                 std::vector<std::string> names) {
  const auto count = static_cast<int>(images.size());
  const std::vector<int> lengths = calibration::legal_lengths(projector);
  if (std::ranges::find(lengths, count) == lengths.end())
    return Error{
        ErrorCode::size_mismatch,
        fmt::format("there are {} photographs, the sequence of a projector of {} has {}", count,
                    to_string(projector), lengths.front()),
        fmt::format("legal numbers, without complements or without rows too: {}", fmt::join(lengths, ", "))};
  const GrayCode both(projector), columns(projector, CodeAxes::columns);
  const bool may_be_columns = count == columns.photographs(), may_be_both = count == both.pairs() + 2;
  if (count == both.photographs()) return CodePhotographs{both, std::move(names), std::move(images)};
  if (may_be_columns && (!may_be_both || (all_alike(images) && neighbours_add_up(images))))
    return CodePhotographs{columns, std::move(names), std::move(images)};
  const GrayCode& code = may_be_both ? both : columns;
  // check_gray_code reports photographs of several sizes.
  if (!all_alike(images)) {
    CodePhotographs raw{code, std::move(names), std::move(images)};
    return check_same_size(raw).error();
  }
  return calibration::with_derived_complements(code, std::move(images), std::move(names));
}

}  // namespace symrig
