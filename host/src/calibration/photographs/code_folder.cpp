// SPDX-License-Identifier: Apache-2.0
#include "calibration/photographs/captured.hpp"
#include "symrig/calibration/capture_file.hpp"
#include "symrig/calibration/gray_code.hpp"
#include "symrig/image/file.hpp"
#include "symrig/image/internal/codec.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace symrig {
namespace {

namespace fs = std::filesystem;

bool is_photograph(const fs::path& path, bool raw) {
  return !has_hidden_name(path) && (has_picture_suffix(path) || (raw && image::lower_suffix(path) == ".raw"));
}

/// The number that starts at `at`, without leading zeros. Moves `at` behind it.
std::string_view digits(const std::string& text, std::size_t& at) {
  const auto is_digit = [&](std::size_t i) {
    return i < text.size() && std::isdigit(static_cast<unsigned char>(text[i]));
  };
  while (text[at] == '0' && is_digit(at + 1)) ++at;
  const std::size_t begin = at;
  while (is_digit(at)) ++at;
  return std::string_view(text).substr(begin, at - begin);
}

/// Natural order: runs of digits compare as numbers, "2.png" before "10.png".
bool natural_less(const std::string& a, const std::string& b) {
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (std::isdigit(static_cast<unsigned char>(a[i])) && std::isdigit(static_cast<unsigned char>(b[j]))) {
      const auto x = digits(a, i), y = digits(b, j);
      if (x != y) return x.size() != y.size() ? x.size() < y.size() : x < y;
    } else if (a[i] != b[j]) {
      return a[i] < b[j];
    } else {
      ++i, ++j;
    }
  }
  return a.size() - i < b.size() - j || (a.size() - i == b.size() - j && a < b);
}

/// The last number in a file's name; −1 if there is none.
long number_in(const fs::path& picture) {
  const std::string name = picture.stem().string();
  const std::size_t last = name.find_last_of("0123456789");
  if (last == std::string::npos) return -1;
  const std::size_t before = name.find_last_not_of("0123456789", last);
  const std::size_t first = before == std::string::npos ? 0 : before + 1;
  return last - first > 8 ? -1 : std::stol(name.substr(first, last - first + 1));
}

/// A camera counts IMG_9998, IMG_9999, IMG_0000 (or IMG_0001). By their names, those after 9999 come first;
/// by their numbers, they follow it. pictures: in natural order.
void follow_the_counter(std::vector<fs::path>& pictures) {
  constexpr long kFirst = 1;
  const long last = number_in(pictures.back()), first = number_in(pictures.front());
  if (first < 0 || first > kFirst || (last != 999 && last != 9'999 && last != 99'999)) return;
  std::vector<std::size_t> gaps;
  for (std::size_t k = 1; k < pictures.size(); ++k)
    if (number_in(pictures[k]) != number_in(pictures[k - 1]) + 1) gaps.push_back(k);
  if (gaps.size() == 1)
    std::rotate(pictures.begin(), pictures.begin() + static_cast<std::ptrdiff_t>(gaps.front()),
                pictures.end());
}

/// raw: whether .raw files count as pictures.
Result<std::vector<fs::path>> list_pictures(const fs::path& folder, bool raw) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) {
    if (error == std::errc::permission_denied)
      return Error{ErrorCode::io, folder.string() + ": cannot be read (Permission denied)",
                   "get permission to read it"};
    return Error{ErrorCode::not_found, folder.string() + ": no such folder",
                 "give the folder of the photographs"};
  }
  std::vector<fs::path> pictures;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
    if (it->is_regular_file(error) && is_photograph(it->path(), raw)) pictures.push_back(it->path());
  if (error) return Error{ErrorCode::io, folder.string() + ": cannot be listed (" + error.message() + ")"};
  if (pictures.empty())
    return Error{ErrorCode::not_found, folder.string() + ": contains no .png, .exr or .pfm file",
                 "give the folder of the photographs"};
  std::ranges::sort(pictures, natural_less, [](const fs::path& p) { return p.filename().string(); });
  follow_the_counter(pictures);
  return pictures;
}

/// The first gap in the files' numbers, for messages; empty if there is none: " (between 02.png and 04.png
/// there is a gap)".
std::string gap_in(const std::vector<fs::path>& pictures) {
  std::string gap;
  std::size_t steps = 0;
  for (std::size_t i = 1; i < pictures.size(); ++i) {
    const long before = number_in(pictures[i - 1]), after = number_in(pictures[i]);
    steps += before >= 0 && after == before + 1 ? 1 : 0;
    if (gap.empty() && before >= 0 && after > before + 1)
      gap = fmt::format(" (between {} and {} there is a gap)", pictures[i - 1].filename().string(),
                        pictures[i].filename().string());
  }
  // Numbers in steps of ten, or numbers that do not count, have no gaps.
  return 2 * steps >= pictures.size() ? gap : std::string();
}

Result<GrayCode> code_of(const fs::path& folder, const std::vector<fs::path>& pictures,
                         const std::optional<Grid>& projector) {
  const int count = static_cast<int>(pictures.size());
  const std::string gap = gap_in(pictures);
  if (!projector) {
    // If a pair is missing, the number of photographs fits another projector.
    if (const auto code = GrayCode::of_length(count); code && gap.empty()) return *code;
    return Error{
        ErrorCode::size_mismatch,
        fmt::format("{}: has {} photographs{}; a Gray-code sequence has 2 (column bits + row bits) + 2",
                    folder.string(), count, gap),
        "add the missing photographs (a projector of 768x1024 has 42), or give the projector's size if "
        "all are there; without complements or rows, its size is necessary"};
  }
  if (!projector->valid())
    return Error{ErrorCode::bad_argument, "projector size " + to_string(*projector) + " is not a grid"};
  const GrayCode code(*projector);
  const std::vector<int> lengths = calibration::legal_lengths(*projector);
  if (std::ranges::find(lengths, count) != lengths.end()) return code;
  return Error{
      ErrorCode::size_mismatch,
      fmt::format("{}: has {} photographs{}; a projector of {} needs {}, or {} without complements",
                  folder.string(), count, gap, to_string(*projector), code.photographs(), code.pairs() + 2),
      "keep only the sequence in the folder, or give the size of the projector that showed it"};
}

/// Finds the photograph that is missing most often, the black one. Then there is one too few. And the last
/// one is as bright as the sum of the pair before it, as white is.
Result<void> check_black_is_there(const fs::path& folder, const std::vector<fs::path>& pictures,
                                  const CaptureFile& capture, const std::optional<Grid>& projector) {
  const auto count = static_cast<int>(pictures.size());
  const bool one_short = projector ? GrayCode(*projector).photographs() == count + 1 : count % 2 != 0;
  if (!one_short || count < 3 || !gap_in(pictures).empty()) return {};
  std::vector<double> means;
  for (auto at = pictures.end() - 3; at != pictures.end(); ++at) {
    SYMRIG_TRY(const auto image, read_captured(*at, capture));
    means.push_back(calibration::mean_light(image));
  }
  constexpr double kMost = 0.75;  // pattern + complement = white + black, and black below a third of white
  if (means[2] < kMost * (means[0] + means[1])) return {};
  return Error{
      ErrorCode::size_mismatch,
      fmt::format("{}: has {} photographs, and the last, {}, is the white one: the black one is missing",
                  folder.string(), count, pictures.back().filename().string()),
      "photograph the projector showing black; its name must come last"};
}

/// A regular sample of the pixels of each picture.
Result<std::vector<std::vector<float>>> thumbnails(const std::vector<fs::path>& pictures,
                                                   const CaptureFile& capture) {
  constexpr std::size_t kPixels = 4096;
  std::vector<std::vector<float>> all;
  for (const fs::path& picture : pictures) {
    SYMRIG_TRY(const auto image, read_captured(picture, capture));
    const auto values = image.values();
    std::vector<float> few;
    for (std::size_t i = 0; i < values.size(); i += values.size() / kPixels + 1) few.push_back(values[i]);
    all.push_back(std::move(few));
  }
  return all;
}

/// The difference between the sums of neighbours if photograph `gap` of the sequence is missing: rms over
/// pairs and pixels, over the mean. In a complete sequence pattern + complement = white + black.
double unlike_sums(const std::vector<std::vector<float>>& pictures, std::size_t gap) {
  const std::size_t pixels = pictures.front().size(), lone = gap / 2 * 2;
  double squares = 0, light = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    double sum = 0, square = 0, count = 0;
    for (std::size_t k = 0; k + 1 < pictures.size(); k += k == lone ? 1 : 2) {
      if (k == lone) continue;
      const auto both = static_cast<double>(pictures[k][i]) + static_cast<double>(pictures[k + 1][i]);
      sum += both, square += both * both, count += 1;
    }
    if (count == 0) return 1;
    squares += std::max(square / count - sum * sum / count / count, 0.0);
    light += sum / count;
  }
  return light > 0 ? std::sqrt(squares * static_cast<double>(pixels)) / light : 1;
}

/// Finds a photograph that is in the folder twice, if there is one too many. Neighbours of a sequence light
/// different parts of the scene, so two that are alike but for noise are the same pattern.
Result<void> check_none_is_doubled(const fs::path& folder, const std::vector<fs::path>& pictures,
                                   const std::vector<std::vector<float>>& few) {
  constexpr double kAlike = 0.15;  // of the next smallest difference
  std::vector<std::pair<double, std::size_t>> apart;
  for (std::size_t k = 0; k + 1 < few.size(); ++k) {
    double squares = 0;
    for (std::size_t i = 0; i < few[k].size(); ++i)
      squares += std::pow(static_cast<double>(few[k + 1][i]) - static_cast<double>(few[k][i]), 2);
    apart.emplace_back(std::sqrt(squares), k);
  }
  std::ranges::partial_sort(apart, apart.begin() + 2);
  if (apart[0].first > kAlike * apart[1].first) return {};
  const auto name = [&](std::size_t k) { return pictures[k].filename().string(); };
  return Error{
      ErrorCode::size_mismatch,
      fmt::format("{}: has {} photographs; {} shows the same as {}: it was taken twice", folder.string(),
                  pictures.size(), name(apart[0].second + 1), name(apart[0].second)),
      "remove one of the two"};
}

/// Finds the photograph whose partner is missing, if the file names do not show it: all other neighbours add
/// up to one picture.
Result<void> check_none_is_missing(const fs::path& folder, const std::vector<fs::path>& pictures,
                                   const CaptureFile& capture, const std::optional<Grid>& projector) {
  const auto count = pictures.size();
  const bool one_short =
      projector ? GrayCode(*projector).photographs() == static_cast<int>(count) + 1 : count % 2 != 0;
  const bool one_more = projector && GrayCode(*projector).photographs() + 1 == static_cast<int>(count);
  if (!(one_short || one_more) || count < 5 || !gap_in(pictures).empty()) return {};
  SYMRIG_TRY(const auto few, thumbnails(pictures, capture));
  for (const auto& one : few)
    if (one.size() != few.front().size()) return {};
  SYMRIG_CHECK(check_none_is_doubled(folder, pictures, few));
  if (!one_short) return {};
  std::size_t lone = 0;
  double least = unlike_sums(few, 0), next = 1e300;
  for (std::size_t gap = 2; gap <= count; gap += 2) {
    const double unlike = unlike_sums(few, gap);
    if (unlike < least)
      next = least, least = unlike, lone = gap;
    else
      next = std::min(next, unlike);
  }
  constexpr double kClearly = 0.7;
  if (!(least < kClearly * next)) return {};
  const auto name = [&](std::size_t k) { return pictures[k].filename().string(); };
  const bool numbered = number_in(pictures.front()) >= 0;
  const std::string what =
      lone == 0 && numbered ? fmt::format("the first one, before {}, is missing", name(0))
      : lone < count        ? fmt::format("the partner of {} is missing, before or after it", name(lone))
                            : fmt::format("the last one, after {}, is missing", name(count - 1));
  return Error{
      ErrorCode::size_mismatch,
      fmt::format("{}: has {} photographs; their light shows that {}", folder.string(), count, what),
      "photograph it, or number the files by their order; a sequence has 2 (column bits + row bits) + "
      "2"};
}

/// All pictures of the folder, in natural order.
Result<CodePhotographs> read_all_pictures(const fs::path& folder, const CaptureFile& capture,
                                          const ReadCodeOptions& options) {
  SYMRIG_TRY(const auto pictures, list_pictures(folder, capture.raw.has_value()));
  const int count = static_cast<int>(pictures.size());
  const auto projector = options.projector ? options.projector : capture.projector;
  if (!projector || projector->valid()) {
    SYMRIG_CHECK(check_black_is_there(folder, pictures, capture, projector));
    SYMRIG_CHECK(check_none_is_missing(folder, pictures, capture, projector));
  }
  SYMRIG_TRY(const GrayCode code, code_of(folder, pictures, projector));
  std::vector<Image<float>> images;
  std::vector<std::string> names;
  calibration::Captured white;
  for (const fs::path& picture : pictures) {
    SYMRIG_TRY(auto read, calibration::read_captured_codes(picture, capture));
    images.push_back(std::move(read.light));
    if (std::ssize(images) == count - 1) white = std::move(read);  // black is the last one
    names.push_back(picture.filename().string());
    if (options.progress && !options.progress({"reading", static_cast<std::int64_t>(images.size()), count}))
      return Error{ErrorCode::interrupted, "reading of " + folder.string() + " was stopped"};
  }
  SYMRIG_TRY(CodePhotographs all,
             arrange_code_photographs(code.projector(), std::move(images), std::move(names)));
  all.saturation = white.saturation;
  all.white_peak = std::move(white.peak);
  return all;
}

}  // namespace

Result<CodePhotographs> read_gray_code_folder(const fs::path& folder, const ReadCodeOptions& options) {
  CaptureFile capture;
  std::error_code error;
  if (const fs::path described = folder / "capture.toml"; fs::exists(described, error)) {
    SYMRIG_TRY(capture, read_capture_file(described));
  }
  SYMRIG_TRY(CodePhotographs photographs, capture.photographs.empty()
                                              ? read_all_pictures(folder, capture, options)
                                              : read_capture(folder, capture, options));
  SYMRIG_CHECK(check_gray_code(photographs));
  return photographs;
}

}  // namespace symrig
