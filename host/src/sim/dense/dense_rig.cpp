// SPDX-License-Identifier: Apache-2.0

#include "symrig/sim/dense_rig.hpp"

#include "sim/dense/raw_matrix.hpp"
#include "symrig/base/files.hpp"
#include "symrig/base/text.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <fstream>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tbb/parallel_for.h>

namespace symrig {

namespace {

constexpr std::string_view kDense = "dense:";
constexpr std::array<std::string_view, 2> kOwnKeys{"grid", "views"};
constexpr std::int64_t kMostPixels = sim::kMostDensePixels;
constexpr std::uint64_t kMostFileBytes = std::uint64_t{1} << 36;

std::optional<std::int64_t> number(std::string_view text) {
  std::int64_t value = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || stop != text.data() + text.size()) return std::nullopt;
  return value;
}

/// "48x64"; both from 1 to kMostPixels.
std::optional<Grid> sides(std::string_view text) {
  const std::size_t cross = std::min(text.find('x'), text.size());
  const std::int64_t rows = number(text.substr(0, cross)).value_or(0);
  const std::int64_t cols = number(text.substr(std::min(cross + 1, text.size()))).value_or(0);
  if (rows < 1 || cols < 1 || rows > kMostPixels || cols > kMostPixels) return std::nullopt;
  return Grid{static_cast<int>(rows), static_cast<int>(cols)};
}

const std::vector<std::string_view>& all_keys() {
  static const std::vector<std::string_view> all = [] {
    std::vector<std::string_view> keys(kOwnKeys.begin(), kOwnKeys.end());
    for (const SceneKey& key : scene_keys()) keys.push_back(key.name);
    return keys;
  }();
  return all;
}

/// Where "?key=" of the first key begins; npos: nowhere. A file's name may contain "?".
std::size_t query_of(std::string_view rest) {
  const std::size_t at = rest.rfind('?');
  if (at == std::string_view::npos) return at;
  const std::string_view query = rest.substr(at + 1);
  const bool key = std::ranges::any_of(
      all_keys(), [query](auto name) { return query.starts_with(std::string(name) + "="); });
  return key ? at : std::string_view::npos;
}

Error unknown_key(std::string_view key, const std::string& rig) {
  return {ErrorCode::bad_argument, fmt::format("there is no key '{}' in {}", key, rig),
          nearest_hint(key, all_keys())};
}

/// Reads one "key=ROWSxCOLS", or keeps a key of a simulated rig.
Result<void> take(DenseUri& uri, std::string_view word, const std::string& rig) {
  const std::size_t equals = std::min(word.find('='), word.size());
  const std::string_view key = word.substr(0, equals);
  if (std::ranges::find(kOwnKeys, key) == kOwnKeys.end()) {
    if (std::ranges::find(all_keys(), key) == all_keys().end()) return unknown_key(key, rig);
    uri.rig_keys += (uri.rig_keys.empty() ? "" : "&") + std::string(word);
    return {};
  }
  const auto value = sides(word.substr(std::min(equals + 1, word.size())));
  if (!value)
    return Error{
        ErrorCode::bad_argument, fmt::format("{} in {} is no size", word, rig),
        fmt::format("write it as dense:T.npy?{}={}, rows x columns", key, key == "grid" ? "48x64" : "2x2")};
  if (key == "grid") uri.grid = *value;
  if (key == "views") uri.views = {value->rows, value->cols};
  return {};
}

using sim::RawMatrix;

/// The grid of a matrix of this shape.
Result<Grid> grid_of(const RawMatrix& raw, const DenseUri& uri) {
  const std::vector<std::int64_t>& s = raw.shape;
  const Error mismatch{
      ErrorCode::size_mismatch, fmt::format("{} has the shape ({})", uri.file.string(), fmt::join(s, ", ")),
      "give T as [n, n] and ?grid=ROWSxCOLS with ROWS x COLS = n, or as [rows, cols, rows, cols]"};
  Grid grid = uri.grid.size() == 0 ? raw.grid : uri.grid;
  if (s.size() == 4 && s[0] == s[2] && s[1] == s[3]) {
    if (grid.size() == 0) grid = {static_cast<int>(s[0]), static_cast<int>(s[1])};
    if (grid.rows != s[0] || grid.cols != s[1]) return mismatch;
  } else if (s.size() == 2 && s[0] == s[1]) {
    const auto side = static_cast<int>(std::lround(std::sqrt(static_cast<double>(s[0]))));
    if (grid.size() == 0 && std::int64_t{side} * side == s[0]) grid = {side, side};
    if (grid.size() != s[0]) return mismatch;
  } else {
    return mismatch;
  }
  if (grid.size() <= kMostPixels) return grid;
  return Error{ErrorCode::limit,
               fmt::format("{}: a dense rig of {} is too large", uri.file.string(), to_string(grid)),
               fmt::format("give at most {} pixels", kMostPixels)};
}

/// Row after row, pixels in raster order.
std::vector<float> numbers_of(const RawMatrix& raw, Grid grid) {
  const auto n = static_cast<std::size_t>(grid.size()), rows = static_cast<std::size_t>(grid.rows);
  const auto raster = [&](std::size_t pixel) {
    return raw.matlab_pixels ? pixel % rows * static_cast<std::size_t>(grid.cols) + pixel / rows : pixel;
  };
  std::vector<float> values(n * n);
  for (std::size_t slow = 0; slow < n; ++slow)
    for (std::size_t fast = 0; fast < n; ++fast) {
      const std::size_t i = raw.columns_first ? fast : slow, j = raw.columns_first ? slow : fast;
      values[raster(i) * n + raster(j)] = static_cast<float>(raw.at(slow * n + fast));
    }
  return values;
}

/// The first bytes of a file; none if it cannot be read, which read_file() explains.
std::string first_bytes(const std::filesystem::path& path) {
  std::string head(1024, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(file.gcount()));
  return head;
}

/// The content of the file chooses the format, never its name.
Result<RawMatrix> read_raw(const std::filesystem::path& path) {
  constexpr std::string_view kHdf = "\x89HDF\r\n\x1a\n";
  constexpr std::size_t kMatlabBlock = 512;
  const std::string head = first_bytes(path);
  if (head.starts_with(kHdf)) return sim::read_hdf(path, false);
  if (head.starts_with("MATLAB 7.3") && head.size() > kMatlabBlock &&
      std::string_view(head).substr(kMatlabBlock).starts_with(kHdf))
    return sim::read_hdf(path, true);
  SYMRIG_TRY(std::vector<std::byte> bytes, read_file(path, kMostFileBytes));
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return sim::is_mat(text) ? sim::read_mat(std::move(bytes), path.string())
                           : sim::read_npy(std::move(bytes), path.string());
}

class DenseScene final : public Scene {
 public:
  explicit DenseScene(DenseMatrix matrix) : matrix_(std::move(matrix)) {}

  using Scene::apply;
  Grid grid() const override { return matrix_.grid; }
  int channels() const override { return 1; }
  /// Sums in double: the same for any number of threads, and exact if T and the pattern are small integers.
  void apply(std::span<const float> p, std::span<float> y, int /*channel*/) const override {
    tbb::parallel_for(std::size_t{0}, p.size(), [&](std::size_t i) {
      const float* const row = matrix_.values.data() + i * p.size();
      double sum = 0;
      for (std::size_t j = 0; j < p.size(); ++j)
        sum += static_cast<double>(row[j]) * static_cast<double>(p[j]);
      y[i] = static_cast<float>(sum);
    });
  }

 private:
  DenseMatrix matrix_;
};

class DenseRig final : public Probe {
 public:
  DenseRig(DenseMatrix matrix, std::string name, ViewLayout views)
      : scene_(std::move(matrix)), name_(std::move(name)), views_(views) {}

  Grid grid() const override { return scene_.grid(); }
  ViewLayout views() const override { return views_; }
  int channels() const override { return 1; }
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override {
    SYMRIG_CHECK(check_patterns(*this, patterns));
    std::vector<Radiance> photographs;
    for (const Pattern& pattern : patterns)
      photographs.push_back({scene_.apply(pattern), Image<float>(grid()), Image<std::uint8_t>(grid(), 1, 1)});
    photographs_ += std::ssize(patterns);
    return photographs;
  }
  ProbeCost cost() const override { return {photographs_, photographs_, 0, 0, 0}; }
  std::string describe() const override { return name_; }

 private:
  DenseScene scene_;
  std::string name_;
  ViewLayout views_;
  std::int64_t photographs_ = 0;
};

/// "T.npy?nois=off" names no file, and T.npy is one.
Result<void> check_no_unknown_key(std::string_view rest, const std::string& rig) {
  const std::size_t at = rest.rfind('?');
  const std::size_t equals = at == std::string_view::npos ? at : rest.find('=', at);
  std::error_code failed;
  if (equals == std::string_view::npos || std::filesystem::exists(rest, failed) ||
      !std::filesystem::exists(rest.substr(0, at), failed))
    return {};
  return unknown_key(rest.substr(at + 1, equals - at - 1), rig);
}

}  // namespace

bool is_dense(const std::string& rig) {
  return rig.starts_with(kDense);
}

Result<DenseUri> parse_dense_uri(const std::string& rig) {
  const std::string_view rest = std::string_view(rig).substr(std::min(kDense.size(), rig.size()));
  const std::size_t at = query_of(rest);
  DenseUri uri{.file = rest.substr(0, at)};
  if (at == std::string_view::npos) {
    SYMRIG_CHECK(check_no_unknown_key(rest, rig));
    return uri;
  }
  for (std::string_view query = rest.substr(at + 1);;) {
    const std::size_t end = query.find('&');
    SYMRIG_CHECK(take(uri, query.substr(0, end), rig));
    if (end == std::string_view::npos) return uri;
    query.remove_prefix(end + 1);
  }
}

Result<DenseMatrix> read_dense(const DenseUri& uri) {
  static_assert(std::endian::native == std::endian::little);
  const std::string file = uri.file.string();
  SYMRIG_TRY(const RawMatrix raw, read_raw(uri.file));
  SYMRIG_TRY(const Grid grid, grid_of(raw, uri));
  if (!uri.views.fits(grid))
    return Error{
        ErrorCode::bad_argument,
        fmt::format("{}: views {} do not tile a grid of {}", file, to_string(uri.views), to_string(grid)),
        "give the rows and columns of views that tile the grid"};
  const auto n = static_cast<std::size_t>(grid.size());
  const std::size_t needed = raw.data + n * n * size_of(raw.type);
  // A .mat file may hold other variables after this one.
  if (raw.bytes.size() < needed || (raw.bytes.size() > needed && !raw.matlab_pixels))
    return sim::no_matrix(file, fmt::format("it has {} bytes, its shape needs {}", raw.bytes.size(), needed));
  DenseMatrix matrix{grid, numbers_of(raw, grid)};
  const auto bad = std::find_if_not(matrix.values.begin(), matrix.values.end(),
                                    [](float value) { return std::isfinite(value); });
  if (bad == matrix.values.end()) {
    constexpr float kLeast = 1e-30F;  // floats have fewer digits below 1e-38
    const auto large = [](float value) { return std::abs(value) >= kLeast; };
    if (std::ranges::any_of(matrix.values, large)) return matrix;
    return Error{ErrorCode::bad_value, fmt::format("{}: T has no value of 1e-30 or more", file),
                 "multiply the matrix by a number"};
  }
  const auto k = static_cast<std::size_t>(bad - matrix.values.begin());
  return Error{ErrorCode::bad_value, fmt::format("{}: T[{}, {}] is not a finite float", file, k / n, k % n),
               "give finite numbers"};
}

double asymmetry(const DenseMatrix& matrix) {
  const auto n = static_cast<std::size_t>(matrix.grid.size());
  float largest = 0, difference = 0;
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j <= i; ++j) {
      const float below = matrix.values[i * n + j], above = matrix.values[j * n + i];
      largest = std::max({largest, std::abs(below), std::abs(above)});
      difference = std::max(difference, std::abs(below - above));
    }
  return largest > 0 ? static_cast<double>(difference) / static_cast<double>(largest) : 0;
}

std::unique_ptr<Scene> make_dense_scene(DenseMatrix matrix) {
  return std::make_unique<DenseScene>(std::move(matrix));
}

std::unique_ptr<Probe> make_dense_rig(DenseMatrix matrix, std::string name, ViewLayout views) {
  return std::make_unique<DenseRig>(std::move(matrix), std::move(name), views);
}

}  // namespace symrig
