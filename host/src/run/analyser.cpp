// SPDX-License-Identifier: Apache-2.0
#include "symrig/run/analyser.hpp"

#include "symrig/base/text.hpp"
#include "symrig/run/compare.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace symrig {
namespace {

constexpr double kMaxRatePpm = 1000;
constexpr std::size_t kMaxAnchors = 200;  // places in the capture that are tried for the first planned edge
constexpr double kOrigin = 1e15;          // picoseconds: before it is room for edges that come early

/// The channel of each line that the plan moves.
using Channels = std::vector<std::pair<int, std::size_t>>;

std::vector<int> moved_lines(const Timeline& plan) {
  std::vector<int> lines;
  for (const PlannedEdge& edge : plan.edges) lines.push_back(edge.line);
  std::sort(lines.begin(), lines.end());
  lines.erase(std::unique(lines.begin(), lines.end()), lines.end());
  return lines;
}

std::string channel_of(const BoardInfo& board, int line, std::span<const ChannelName> names) {
  const std::string& own = board.lines.at(static_cast<std::size_t>(line)).name;
  for (const ChannelName& name : names)
    if (name.line == own) return name.channel;
  return own;
}

Result<void> check_names(const BoardInfo& board, const AnalyserCapture& capture,
                         std::span<const ChannelName> names) {
  for (const ChannelName& name : names) {
    if (board.line(name.line) < 0)
      return Error{ErrorCode::unknown_name, fmt::format("the board has no line '{}'", name.line),
                   "symrig info lists its lines"};
    if (std::find(capture.channels.begin(), capture.channels.end(), name.channel) == capture.channels.end())
      return Error{ErrorCode::unknown_name, fmt::format("the capture has no channel '{}'", name.channel),
                   nearest_hint(name.channel, capture.channels)};
  }
  return {};
}

Result<Channels> channels_of(const Timeline& plan, const BoardInfo& board, const AnalyserCapture& capture,
                             std::span<const ChannelName> names, AnalyserComparison& out) {
  SYMRIG_CHECK(check_names(board, capture, names));
  Channels found;
  for (const int line : moved_lines(plan)) {
    const std::string wanted = channel_of(board, line, names);
    const auto channel = std::find(capture.channels.begin(), capture.channels.end(), wanted);
    if (channel == capture.channels.end()) {
      out.unseen.push_back(line);
      continue;
    }
    found.emplace_back(line, static_cast<std::size_t>(channel - capture.channels.begin()));
    out.lines.push_back(line);
  }
  if (found.empty())
    return Error{ErrorCode::bad_value,
                 fmt::format("no channel of the capture is a line that the plan moves (channels: {})",
                             fmt::join(capture.channels, ", ")),
                 "name them: channel camera_trigger=D0"};
  return found;
}

/// The plan's edges on these lines; tick: picoseconds after kOrigin + the first planned edge.
Timeline plan_in_picoseconds(const Timeline& plan, const Channels& channels) {
  Timeline out;
  out.rate = {1'000'000'000'000};
  const double tick_ps = 1e12 / static_cast<double>(plan.rate.hz);
  for (const PlannedEdge& edge : plan.edges) {
    const bool seen = std::any_of(channels.begin(), channels.end(),
                                  [&](const auto& channel) { return channel.first == edge.line; });
    if (!seen) continue;
    PlannedEdge moved = edge;
    const auto since = static_cast<double>(edge.tick.count - plan.edges.front().tick.count);
    moved.tick = {static_cast<std::uint64_t>(std::llround(kOrigin + since * tick_ps))};
    out.edges.push_back(moved);
  }
  return out;
}

/// The capture's edges on these lines, so that the edge at `anchor_ns` stands where the first planned one
/// does. Those that are clearly before or after the run are counted in `outside`.
std::vector<CapturedEdge> seen_in_picoseconds(const AnalyserCapture& capture, const Channels& channels,
                                              double anchor_ns, const Timeline& plan, std::size_t& outside) {
  const auto first = static_cast<double>(plan.edges.front().tick.count);
  const auto last = static_cast<double>(plan.edges.back().tick.count);
  const double slack =
      2e3 * capture.resolution_ns + (last - first) * kMaxRatePpm * 1e-6 + 1e6;  // and a microsecond
  outside = 0;
  std::vector<CapturedEdge> seen;
  for (const AnalyserCapture::Edge& edge : capture.edges) {
    const auto channel = std::find_if(channels.begin(), channels.end(),
                                      [&](const auto& one) { return one.second == edge.channel; });
    if (channel == channels.end()) continue;
    const double at = first + (edge.ns - anchor_ns) * 1e3;
    if (at < first - slack || at > last + slack) {
      ++outside;
      continue;
    }
    CapturedEdge moved{};
    moved.line = channel->first;
    moved.level = edge.level;
    moved.tick = {static_cast<std::uint64_t>(std::llround(at))};
    seen.push_back(moved);
  }
  return seen;
}

/// Fits seen = offset + (1 + rate) planned, and fills in the pairs.
void judge(const Comparison& all, AnalyserComparison& out) {
  out.pairs.clear();
  out.missing = all.missing.size();
  out.unplanned = all.unplanned.size();
  double mean_x = 0;
  double mean_y = 0;
  for (const EdgePair& pair : all.pairs) {
    const double planned = (static_cast<double>(pair.planned.tick.count) - kOrigin) * 1e-3;
    out.pairs.push_back({pair.planned.line, pair.planned.level, planned,
                         planned + static_cast<double>(pair.late()) * 1e-3, 0});
    mean_x += planned;
    mean_y += static_cast<double>(pair.late()) * 1e-3;
  }
  const auto count = static_cast<double>(std::max<std::size_t>(out.pairs.size(), 1));
  mean_x /= count;
  mean_y /= count;
  double xx = 0;
  double xy = 0;
  for (const AnalyserPair& pair : out.pairs) {
    xx += (pair.planned_ns - mean_x) * (pair.planned_ns - mean_x);
    xy += (pair.planned_ns - mean_x) * (pair.seen_ns - pair.planned_ns - mean_y);
  }
  const double rate = xx > 0 ? std::clamp(xy / xx, -kMaxRatePpm * 1e-6, kMaxRatePpm * 1e-6) : 0;
  out.rate_ppm = 1e6 * rate;
  out.largest_ns = 0;
  for (AnalyserPair& pair : out.pairs) {
    pair.difference_ns = pair.seen_ns - pair.planned_ns - mean_y - rate * (pair.planned_ns - mean_x);
    out.largest_ns = std::max(out.largest_ns, std::abs(pair.difference_ns));
  }
}

bool better(const AnalyserComparison& a, const AnalyserComparison& b) {
  const std::size_t wrong_a = a.missing + a.unplanned;
  const std::size_t wrong_b = b.missing + b.unplanned;
  return wrong_a != wrong_b ? wrong_a < wrong_b : a.largest_ns < b.largest_ns;
}

/// The times in the capture at which the plan's first edge may be.
std::vector<double> anchors(const AnalyserCapture& capture, const Channels& channels,
                            const PlannedEdge& first) {
  std::vector<double> times;
  for (const AnalyserCapture::Edge& edge : capture.edges) {
    const bool same = std::any_of(channels.begin(), channels.end(), [&](const auto& channel) {
      return channel.first == first.line && channel.second == edge.channel;
    });
    if (same && edge.level == first.level) times.push_back(edge.ns);
    if (times.size() == kMaxAnchors) break;
  }
  return times;
}

}  // namespace

Result<AnalyserComparison> compare_with_analyser(const Timeline& plan, const BoardInfo& board,
                                                 const AnalyserCapture& capture,
                                                 std::span<const ChannelName> names,
                                                 std::optional<Nanoseconds> allowed) {
  AnalyserComparison out;
  if (plan.edges.empty())
    return Error{ErrorCode::bad_value, "the plan has no edge", "give a program that moves a line"};
  SYMRIG_TRY(const Channels channels, channels_of(plan, board, capture, names, out));
  const double tick_ns = 1e9 / static_cast<double>(board.rate.hz);
  out.allowed_ns = allowed
                       ? static_cast<double>(allowed->count())
                       : capture.resolution_ns + tick_ns * (1 + static_cast<double>(board.lateness.count));
  const Timeline planned = plan_in_picoseconds(plan, channels);
  std::uint32_t watched = 0;
  for (const int line : out.lines) watched |= 1U << static_cast<unsigned>(line);
  std::optional<AnalyserComparison> best;
  for (const double anchor : anchors(capture, channels, planned.edges.front())) {
    AnalyserComparison tried = out;
    const auto seen = seen_in_picoseconds(capture, channels, anchor, planned, tried.outside);
    judge(compare(planned, seen, watched), tried);
    if (!best || better(tried, *best)) best = std::move(tried);
  }
  if (!best)
    return Error{ErrorCode::bad_value, "the capture does not show the plan's first edge",
                 "check the probes and their channels, and that the capture includes the start of the run"};
  return *std::move(best);
}

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
