// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/trace_line.hpp"

#include <charconv>
#include <optional>
#include <utility>

namespace symrig::bench_vm {

namespace {

/// Removes a whole number from the front of the text.
template <class T>
std::optional<T> take_number(std::string_view& text) {
  T value{};
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{}) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(stop - text.data()));
  return value;
}

bool take(std::string_view& text, std::string_view prefix) {
  if (!text.starts_with(prefix)) return false;
  text.remove_prefix(prefix.size());
  return true;
}

/// "1234.567890", the last word before the event's name.
std::optional<Nanoseconds> parse_time(std::string_view before) {
  const std::size_t space = before.rfind(' ');
  std::string_view text = space == std::string_view::npos ? before : before.substr(space + 1);
  const auto whole = take_number<std::int64_t>(text);
  if (!whole || !take(text, ".") || text.size() != 6) return std::nullopt;
  const auto microseconds = take_number<std::int64_t>(text);
  if (!microseconds || !text.empty()) return std::nullopt;
  return Nanoseconds{*whole * 1'000'000'000 + *microseconds * 1'000};
}

/// "503 set 1"
std::optional<std::pair<int, bool>> parse_set(std::string_view text) {
  const auto gpio = take_number<int>(text);
  if (!gpio || !take(text, " set ")) return std::nullopt;
  const auto level = take_number<int>(text);
  if (!level) return std::nullopt;
  return std::pair{*gpio, *level != 0};
}

}  // namespace

TraceEvent parse_trace_line(std::string_view line) {
  constexpr std::string_view kLost = "[LOST ";
  constexpr std::string_view kValue = ": gpio_value: ";
  if (const std::size_t at = line.find(kLost); at != std::string_view::npos) {
    line.remove_prefix(at + kLost.size());
    return EventsLost{take_number<std::uint64_t>(line).value_or(1)};
  }
  const std::size_t at = line.find(kValue);
  if (at == std::string_view::npos) return std::monostate{};
  const auto time = parse_time(line.substr(0, at));
  const auto set = parse_set(line.substr(at + kValue.size()));
  if (!time || !set) return std::monostate{};
  return LineSet{set->first, set->second, *time};
}

std::vector<std::string> LineSplitter::feed(std::string_view piece) {
  std::vector<std::string> lines;
  for (std::size_t end = piece.find('\n'); end != std::string_view::npos; end = piece.find('\n')) {
    rest_.append(piece.substr(0, end));
    lines.push_back(std::exchange(rest_, {}));
    piece.remove_prefix(end + 1);
  }
  rest_.append(piece);
  return lines;
}

}  // namespace symrig::bench_vm
