// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/screen_reader.hpp"
#include "sim/light/random.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <utility>

namespace symrig::bench_vm {

namespace {

constexpr double kWhite = 255.0 * 3;

std::uint32_t pixel(const ScanoutPixels& pixels, int row, int col) {
  std::uint32_t code = 0;
  std::memcpy(&code,
              pixels.first + static_cast<std::size_t>(row) * pixels.pitch +
                  static_cast<std::size_t>(col) * sizeof code,
              sizeof code);
  return code;
}

/// The sum of red, green and blue.
std::uint32_t brightness(std::uint32_t code) {
  return (code >> 16U & 0xffU) + (code >> 8U & 0xffU) + (code & 0xffU);
}

struct Span {
  int begin;
  int end;
};

/// The screen rows or columns of a cell that are on the screen.
Span cell_span(int first, int number, int cell, int screen) {
  const int begin = first + number * cell;
  return {std::clamp(begin, 0, screen), std::clamp(begin + cell, 0, screen)};
}

double cell_light(const ScanoutPixels& pixels, Span rows, Span cols, int cell) {
  std::uint64_t sum = 0;
  for (int row = rows.begin; row < rows.end; ++row)
    for (int col = cols.begin; col < cols.end; ++col) sum += brightness(pixel(pixels, row, col));
  return static_cast<double>(sum) / (kWhite * cell * cell);
}

}  // namespace

Image<float> light_on_grid(const ScanoutPixels& pixels, const Placement& placement) {
  Image<float> light(placement.grid, 1);
  std::size_t i = 0;
  for (int row = 0; row < placement.grid.rows; ++row) {
    const Span rows = cell_span(placement.top, row, placement.cell, pixels.rows);
    for (int col = 0; col < placement.grid.cols; ++col) {
      const Span cols = cell_span(placement.left, col, placement.cell, pixels.cols);
      light.values()[i++] = static_cast<float>(cell_light(pixels, rows, cols, placement.cell));
    }
  }
  return light;
}

std::uint64_t cell_checksum(const ScanoutPixels& pixels, const Placement& placement) {
  std::uint64_t key = 0;
  for (int row = 0; row < placement.grid.rows; ++row) {
    const int y = placement.top + row * placement.cell + placement.cell / 2;
    if (y < 0 || y >= pixels.rows) continue;
    for (int col = 0; col < placement.grid.cols; ++col) {
      const int x = placement.left + col * placement.cell + placement.cell / 2;
      if (x >= 0 && x < pixels.cols) key = sim::combine(key, pixel(pixels, y, x));
    }
  }
  return key;
}

namespace {

bool same(const Picture& a, const Picture& b) {
  if (a == nullptr || b == nullptr) return a == b;
  return std::ranges::equal(a->values(), b->values());
}

}  // namespace

bool ScreenTimeline::change(Nanoseconds since, Picture pattern) {
  if (changes_.empty() ? pattern == nullptr : same(changes_.back().pattern, pattern)) return false;
  const std::uint64_t number = pattern ? shown_++ : shown_;
  changes_.push_back({since, number, std::move(pattern)});
  return true;
}

std::vector<ScreenTimeline::Lit> ScreenTimeline::during(Nanoseconds begin, Nanoseconds end) const {
  std::vector<Lit> lit;
  for (std::size_t i = 0; i < changes_.size(); ++i) {
    const Nanoseconds from = std::max(begin, changes_[i].since);
    const Nanoseconds to = i + 1 < changes_.size() ? std::min(end, changes_[i + 1].since) : end;
    if (from >= to || changes_[i].pattern == nullptr) continue;
    const double share = from == begin && to == end ? 1 : seconds(to - from) / seconds(end - begin);
    lit.push_back({changes_[i].number, changes_[i].pattern, share});
  }
  return lit;
}

Picture ScreenTimeline::at(Nanoseconds time) const {
  Picture shown;
  for (const Change& change : changes_)
    if (change.since <= time) shown = change.pattern;
  return shown;
}

std::vector<Nanoseconds> ScreenTimeline::changes_within(Nanoseconds begin, Nanoseconds end) const {
  std::vector<Nanoseconds> times;
  for (const Change& change : changes_)
    if (change.since > begin && change.since < end) times.push_back(change.since);
  return times;
}

void ScreenTimeline::forget_before(Nanoseconds time) {
  while (changes_.size() > 1 && changes_[1].since <= time) changes_.pop_front();
}

ScreenTimeline::Lit ScreenTimeline::newest() const {
  if (changes_.empty()) return {};
  return {changes_.back().number, changes_.back().pattern, 1};
}

namespace {

constexpr std::size_t kKept = 16;  // joined pictures that an exposure, or the next one, may ask for again

/// Pictures of one size, side by side.
Picture side_by_side(const std::vector<Picture>& parts) {
  const auto on = std::ranges::find_if(parts, [](const Picture& part) { return part != nullptr; });
  if (on == parts.end()) return nullptr;
  const Grid part = (*on)->grid();
  const std::size_t cols = part.cols, row = parts.size() * cols;
  auto all = std::make_shared<Image<float>>(Grid{part.rows, static_cast<int>(row)}, 1);
  for (std::size_t k = 0; k < parts.size(); ++k) {
    if (parts[k] == nullptr) continue;
    const auto from = parts[k]->values();
    for (std::size_t i = 0; i < from.size(); ++i)
      all->values()[i / cols * row + k * cols + i % cols] = from[i];
  }
  return all;
}

}  // namespace

bool JoinedScreens::change(std::size_t screen, Nanoseconds since, Picture pattern) {
  return screens_[screen].change(since, std::move(pattern));
}

void JoinedScreens::forget_before(Nanoseconds time) {
  for (ScreenTimeline& screen : screens_) screen.forget_before(time);
}

std::vector<ScreenTimeline::Lit> JoinedScreens::during(Nanoseconds begin, Nanoseconds end) {
  if (screens_.size() == 1) return screens_[0].during(begin, end);
  // Between two changes, of whatever screen, the joined picture is one.
  std::vector<Nanoseconds> times{begin, end};
  for (const ScreenTimeline& screen : screens_) {
    const auto changes = screen.changes_within(begin, end);
    times.insert(times.end(), changes.begin(), changes.end());
  }
  std::ranges::sort(times);
  times.erase(std::unique(times.begin(), times.end()), times.end());
  std::vector<ScreenTimeline::Lit> lit;
  for (std::size_t k = 0; k + 1 < times.size(); ++k) {
    std::vector<Picture> parts;
    for (const ScreenTimeline& screen : screens_) parts.push_back(screen.at(times[k]));
    ScreenTimeline::Lit one = join(parts);
    if (one.pattern == nullptr) continue;
    one.share = times.size() == 2 ? 1 : seconds(times[k + 1] - times[k]) / seconds(end - begin);
    lit.push_back(std::move(one));
  }
  return lit;
}

ScreenTimeline::Lit JoinedScreens::newest() {
  if (screens_.size() == 1) return screens_[0].newest();
  std::vector<Picture> parts;
  for (const ScreenTimeline& screen : screens_) parts.push_back(screen.newest().pattern);
  return join(parts);
}

/// Equal parts give the same picture again, so that its light is computed once.
ScreenTimeline::Lit JoinedScreens::join(const std::vector<Picture>& parts) {
  const auto known = std::ranges::find(joined_, parts, &Joined::parts);
  if (known != joined_.end()) return {known->number, known->pattern, 1};
  Picture pattern = side_by_side(parts);
  if (pattern == nullptr) return {};
  if (joined_.size() == kKept) joined_.pop_front();
  joined_.push_back({parts, made_++, std::move(pattern)});
  return {joined_.back().number, joined_.back().pattern, 1};
}

namespace {

constexpr Nanoseconds kTriggerPulse{100'000};

std::uint32_t word_at(const ScanoutPixels& pixels, int row, int col) {
  std::uint32_t word = 0;
  if (row < 0 || col < 0 || row >= pixels.rows || col >= pixels.cols) return word;
  std::memcpy(&word,
              pixels.first + static_cast<std::size_t>(row) * pixels.pitch +
                  static_cast<std::size_t>(col) * sizeof word,
              sizeof word);
  return word;
}

Picture plane_of(std::span<const std::uint32_t> words, Grid grid, int number) {
  auto picture = std::make_shared<Image<float>>(grid, 1);
  const auto bit = static_cast<unsigned>(bit_of(number));
  std::ranges::transform(words, picture->values().begin(),
                         [bit](std::uint32_t word) { return static_cast<float>(word >> bit & 1U); });
  return picture;
}

}  // namespace

std::vector<std::uint32_t> cell_words(const ScanoutPixels& pixels, const Placement& placement) {
  std::vector<std::uint32_t> words;
  words.reserve(placement.grid.size());
  const int middle = placement.cell / 2;
  for (int row = 0; row < placement.grid.rows; ++row)
    for (int col = 0; col < placement.grid.cols; ++col)
      words.push_back(word_at(pixels, placement.top + row * placement.cell + middle,
                              placement.left + col * placement.cell + middle));
  return words;
}

int bit_of(int number) {
  constexpr std::array kFirst{8, 16, 0};  // of green, red, blue
  return kFirst.at(static_cast<std::size_t>(number / 8)) + number % 8;
}

std::vector<Change> light_of_planes(std::span<const std::uint32_t> words, Grid grid,
                                    const ShownSequence& sequence, Nanoseconds start) {
  const auto dark = std::make_shared<const Image<float>>(grid, 1);
  std::vector<Change> changes;
  for (std::size_t k = 0; k < sequence.planes.size(); ++k) {
    const Nanoseconds begin = start + static_cast<std::int64_t>(k) * sequence.period;
    changes.emplace_back(begin, plane_of(words, grid, sequence.planes[k]));
    if (sequence.exposure < sequence.period) changes.emplace_back(begin + sequence.exposure, dark);
  }
  changes.emplace_back(start + static_cast<std::int64_t>(sequence.planes.size()) * sequence.period, dark);
  return changes;
}

std::vector<TriggerEdge> edges_of_refresh(const ShownSequence& sequence, Nanoseconds start) {
  using Line = TriggerEdge::Line;
  const Nanoseconds frame = start - sequence.frame_lead;
  const Nanoseconds last = start + static_cast<std::int64_t>(sequence.planes.size()) * sequence.period;
  std::vector<TriggerEdge> edges{{frame, Line::frame, true},
                                 {sequence.frames_all ? last : frame + kTriggerPulse, Line::frame, false}};
  for (std::size_t k = 0; k < sequence.planes.size(); ++k) {
    const Nanoseconds begin = start + static_cast<std::int64_t>(k) * sequence.period;
    edges.push_back({begin, Line::plane, true});
    edges.push_back({begin + kTriggerPulse, Line::plane, false});
  }
  std::ranges::stable_sort(edges, {}, &TriggerEdge::at);
  return edges;
}

}  // namespace symrig::bench_vm
