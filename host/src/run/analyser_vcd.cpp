// SPDX-License-Identifier: Apache-2.0
#include "symrig/run/analyser.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <utility>

#include <fmt/format.h>

namespace symrig {
namespace {

constexpr std::size_t kMaxChannels = 1024;

/// The words of a text, with their line for messages.
class Words {
 public:
  explicit Words(std::string_view text) : text_(text) {}

  /// Empty at the end.
  std::string_view next() {
    while (at_ < text_.size() && blank(text_[at_])) line_ += text_[at_++] == '\n' ? 1 : 0;
    const std::size_t begin = at_;
    while (at_ < text_.size() && !blank(text_[at_])) ++at_;
    return text_.substr(begin, at_ - begin);
  }
  /// The words up to $end, separated by one space.
  std::string to_end() {
    std::string words;
    for (auto word = next(); !word.empty() && word != "$end"; word = next())
      words.append(words.empty() ? "" : " ").append(word);
    return words;
  }
  std::size_t line() const { return line_; }

 private:
  static bool blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

  std::string_view text_;
  std::size_t at_ = 0;
  std::size_t line_ = 1;
};

std::optional<double> positive(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !(value > 0)) return std::nullopt;
  return value;
}

/// "10 ns", "1us" in nanoseconds.
std::optional<double> timescale_ns(std::string text) {
  std::erase(text, ' ');
  constexpr std::array<std::pair<std::string_view, double>, 6> kUnits{
      {{"fs", 1e-6}, {"ps", 1e-3}, {"ns", 1}, {"us", 1e3}, {"ms", 1e6}, {"s", 1e9}}};
  for (const auto& [unit, ns] : kUnits) {
    if (!text.ends_with(unit)) continue;
    const auto number = positive(std::string_view(text).substr(0, text.size() - unit.size()));
    if (number) return *number * ns;
  }
  return std::nullopt;
}

/// sigrok writes "Acquisition with 2/8 channels at 24 MHz" into a comment. The sample period in nanoseconds.
std::optional<double> sample_ns(std::string_view comment) {
  const std::size_t at = comment.rfind(" at ");
  if (at == std::string_view::npos || !comment.ends_with("Hz")) return std::nullopt;
  Words words(comment.substr(at + 4));
  const auto number = positive(words.next());
  const std::string_view unit = words.next();
  constexpr std::array<std::pair<std::string_view, double>, 4> kUnits{
      {{"Hz", 1e9}, {"kHz", 1e6}, {"MHz", 1e3}, {"GHz", 1}}};
  for (const auto& [name, ns] : kUnits)
    if (number && unit == name) return ns / *number;
  return std::nullopt;
}

class Reader {
 public:
  explicit Reader(std::string_view text) : words_(text) {}

  Result<AnalyserCapture> read() {
    for (auto word = words_.next(); !word.empty(); word = words_.next()) SYMRIG_CHECK(take(word));
    if (capture_.channels.empty()) return wrong("no wire of one bit");
    capture_.resolution_ns = sample_.value_or(unit_ns_);
    return std::move(capture_);
  }

 private:
  Error wrong(std::string_view what) const {
    return {ErrorCode::bad_format, fmt::format("line {}: {}", words_.line(), what),
            "give a VCD file of a logic analyser (sigrok-cli -O vcd)"};
  }

  Result<void> take(std::string_view word) {
    if (word == "$timescale") return timescale();
    if (word == "$var") return variable();
    if (word == "$comment") {
      if (const auto period = sample_ns(words_.to_end())) sample_ = period;
      return {};
    }
    if (word == "$dumpvars" || word == "$dumpall" || word == "$dumpon" || word == "$dumpoff" ||
        word == "$end")
      return {};
    if (word.front() == '$') {
      words_.to_end();
      return {};
    }
    if (word.front() == '#') return time(word.substr(1));
    if (word.front() == 'b' || word.front() == 'B') return value(word.substr(1), words_.next());
    if (word.front() == 'r' || word.front() == 'R') {
      words_.next();
      return {};
    }
    return value(word.substr(0, 1), word.substr(1));
  }

  Result<void> timescale() {
    const auto unit = timescale_ns(words_.to_end());
    if (!unit) return wrong("$timescale is no time");
    unit_ns_ = *unit;
    return {};
  }

  Result<void> variable() {
    words_.next();
    const std::string_view size = words_.next();
    const std::string_view id = words_.next();
    const std::string_view name = words_.next();
    words_.to_end();
    if (id.empty() || name.empty()) return wrong("$var has no name");
    if (size != "1") return {};
    if (capture_.channels.size() == kMaxChannels) return wrong("more than 1,024 wires");
    channels_[std::string(id)] = capture_.channels.size();
    capture_.channels.emplace_back(name);
    levels_.emplace_back();
    return {};
  }

  Result<void> time(std::string_view text) {
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return wrong("a time is no number");
    const double ns = static_cast<double>(value) * unit_ns_;
    if (ns < now_ns_) return wrong("time goes back");
    now_ns_ = ns;
    return {};
  }

  Result<void> value(std::string_view bits, std::string_view id) {
    const auto channel = channels_.find(std::string(id));
    if (channel == channels_.end())
      return bits.size() == 1 && id.empty() ? wrong("a value without a wire") : Result<void>();
    const char bit = bits.empty() ? 'x' : bits.back();
    if (std::string_view("01xXzZ").find(bit) == std::string_view::npos)
      return wrong("a value is not 0, 1, x or z");
    std::optional<bool>& level = levels_[channel->second];
    if (bit != '0' && bit != '1') {
      level.reset();
      return {};
    }
    const bool high = bit == '1';
    if (level && *level != high) capture_.edges.push_back({now_ns_, channel->second, high});
    level = high;
    return {};
  }

  Words words_;
  AnalyserCapture capture_;
  std::map<std::string, std::size_t, std::less<>> channels_;
  std::vector<std::optional<bool>> levels_;
  double unit_ns_ = 1;
  double now_ns_ = 0;
  std::optional<double> sample_;
};

}  // namespace

Result<AnalyserCapture> read_analyser_vcd(std::string_view text) {
  return Reader(text).read();
}

}  // namespace symrig
