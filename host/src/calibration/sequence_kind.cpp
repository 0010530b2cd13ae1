// SPDX-License-Identifier: Apache-2.0
#include "calibration/sequence_kind.hpp"

#include "symrig/base/quantile.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace symrig {
namespace {

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
