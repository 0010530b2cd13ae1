// SPDX-License-Identifier: Apache-2.0
#include "viewer/light_code.hpp"

#include "tensor/half.hpp"

#include <cmath>
#include <cstring>

namespace symrig::viewer {
namespace {

constexpr int kTopOfPlane = 7;

/// Reads numbers from bytes; false at their end.
class LightReader {
 public:
  explicit LightReader(std::string_view bytes) : rest_(bytes) {}
  template <class T>
  bool read(T& value) {
    if (rest_.size() < sizeof(T)) return false;
    std::memcpy(&value, rest_.data(), sizeof(T));
    rest_.remove_prefix(sizeof(T));
    return true;
  }
  std::size_t left() const { return rest_.size(); }

 private:
  std::string_view rest_;
};

struct Run {
  std::uint32_t first = 0, length = 0;
};

std::optional<std::vector<Run>> read_runs(LightReader& reader, std::uint64_t pixels) {
  std::uint32_t count = 0;
  if (!reader.read(count) || count > reader.left() / sizeof(Run)) return std::nullopt;
  std::vector<Run> runs(count);
  for (Run& run : runs)
    if (!reader.read(run) || run.first > pixels || run.length > pixels - run.first) return std::nullopt;
  return runs;
}

bool read_plane(LightReader& reader, Image<float>& plane) {
  const auto runs = read_runs(reader, plane.values().size());
  if (!runs) return false;
  std::uint64_t halves = 0;
  for (const Run& run : *runs)
    for (float& value : plane.values().subspan(run.first, run.length)) {
      tensor::Half half = 0;
      if (!reader.read(half)) return false;
      value = tensor::from_half(half);
      if (!std::isfinite(value)) return false;
      ++halves;
    }
  tensor::Half padding = 0;
  return halves % 2 == 0 || reader.read(padding);
}

}  // namespace

/// The page joins runs with less than 8 dark pixels between them, so a pixel takes less than 3 bytes.
std::uint64_t most_light_bytes(Grid grid) {
  return 3 * (std::uint64_t{4} * static_cast<std::uint64_t>(grid.size()) + 64);
}

std::optional<std::vector<Image<float>>> decode_light(std::string_view bytes, Grid grid) {
  LightReader reader(bytes);
  std::uint32_t planes = 0;
  if (!reader.read(planes) || (planes != 1 && planes != 3)) return std::nullopt;
  std::vector<Image<float>> light(planes, Image<float>(grid));
  for (Image<float>& plane : light)
    if (!read_plane(reader, plane)) return std::nullopt;
  if (reader.left() != 0) return std::nullopt;
  return light;
}

void append_plane(std::string& to, std::span<const float> values) {
  std::vector<tensor::Half> halves(values.size() + values.size() % 2);
  const auto exponent = static_cast<std::int32_t>(tensor::to_halves(values, kTopOfPlane, halves.data()));
  to.append(reinterpret_cast<const char*>(&exponent), sizeof(exponent));
  to.append(reinterpret_cast<const char*>(halves.data()), halves.size() * sizeof(tensor::Half));
}

}  // namespace symrig::viewer
