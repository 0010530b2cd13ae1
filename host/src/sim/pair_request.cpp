// SPDX-License-Identifier: Apache-2.0
#include "sim/pair_request.hpp"

#include <bit>
#include <charconv>

namespace symrig::sim {
namespace {

static_assert(std::endian::native == std::endian::little, "the numbers of the framing are little-endian");

template <class T>
void append(std::vector<std::byte>& bytes, std::span<const T> values) {
  const auto more = std::as_bytes(values);
  bytes.insert(bytes.end(), more.begin(), more.end());
}

template <class T>
void append_one(std::vector<std::byte>& bytes, const T& value) {
  append(bytes, std::span<const T>(&value, 1));
}

/// A number from 1 to `most` at the beginning of the text, which it removes.
std::optional<std::size_t> take_number(std::string_view& text, std::size_t most) {
  std::size_t value = 0;
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failed != std::errc{} || value > most) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return value;
}

}  // namespace

std::optional<DevelopHeader> parse_develop(std::string_view line) {
  constexpr std::string_view kDevelop = "develop ";
  if (!line.starts_with(kDevelop)) return std::nullopt;
  line.remove_prefix(kDevelop.size());
  const auto patterns = take_number(line, kMostPatterns);
  if (!patterns || !line.starts_with(' ')) return std::nullopt;
  line.remove_prefix(1);
  const auto exposures = take_number(line, kMostExposures);
  if (!exposures || *exposures == 0 || !line.empty()) return std::nullopt;
  return DevelopHeader{*patterns, *exposures};
}

std::vector<std::byte> encode_develop(std::span<const LitPattern> patterns,
                                      std::span<const LitExposure> exposures) {
  std::vector<std::byte> bytes;
  for (const LitPattern& one : patterns) {
    append_one(bytes, one.shown_before);
    append(bytes, one.pattern->values());
  }
  for (const LitExposure& one : exposures) {
    append_one(bytes, ExposureHead{one.seconds, one.noise, one.shares.size()});
    for (const LitExposure::Share& part : one.shares)
      append_one(bytes, ShareRecord{part.pattern, part.share});
  }
  return bytes;
}

std::size_t frame_bytes(bool noisy, std::int64_t values) {
  return static_cast<std::size_t>(values) * (noisy ? sizeof(std::uint16_t) : sizeof(float));
}

}  // namespace symrig::sim
