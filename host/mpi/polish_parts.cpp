// SPDX-License-Identifier: Apache-2.0

#include "polish_parts.hpp"

#include "acquisition/errors/checks.hpp"
#include "symrig/report/internal/json_text.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>

namespace symrig::mpi {

namespace {

using acquisition::KnownLeaf;
using acquisition::KnownTransport;

std::size_t begin_of(std::size_t n, std::size_t part, std::size_t parts) {
  return n * part / parts;
}

/// A leaf of rank k as k leaves of rank 1 on the same blocks. factors: for each channel A, then B, column by
/// column.
void add_leaf(KnownTransport& known, const Leaf& leaf, std::span<const float> factors, int channels) {
  const auto rows = static_cast<std::size_t>(leaf.rows()), cols = static_cast<std::size_t>(leaf.cols());
  const auto rank = static_cast<std::size_t>(leaf.rank);
  std::vector<float> one;
  for (std::size_t k = 0; k < rank; ++k) {
    one.clear();
    for (std::size_t channel = 0; channel < static_cast<std::size_t>(channels); ++channel) {
      const auto both = factors.subspan(channel * rank * (rows + cols), rank * (rows + cols));
      const auto a = both.subspan(k * rows, rows), b = both.subspan(rank * rows + k * cols, cols);
      one.insert(one.end(), a.begin(), a.end());
      one.insert(one.end(), b.begin(), b.end());
    }
    const std::int32_t number =
        known.add_leaf(leaf.row_begin, leaf.row_end, leaf.col_begin, leaf.col_end, leaf.level, one);
    if (k > 0) known.join(number);
  }
}

/// The inverse of add_leaf. run: the leaves of rank 1.
void append_factors(const KnownTransport& known, std::span<const KnownLeaf> run, int channels,
                    std::vector<float>& to) {
  for (int channel = 0; channel < channels; ++channel) {
    for (const KnownLeaf& leaf : run) {
      const auto a = known.sides(leaf, channel).a;
      to.insert(to.end(), a.begin(), a.end());
    }
    for (const KnownLeaf& leaf : run) {
      const auto b = known.sides(leaf, channel).b;
      to.insert(to.end(), b.begin(), b.end());
    }
  }
}

Result<void> check_polishable(const TransportTensor& whole) {
  if (whole.symmetric() && whole.columns().empty() && whole.bands().size() <= 1) return {};
  return Error{ErrorCode::bad_value, "T is not the symmetric sum of leaves that a search makes",
               "polish refits captures of the algorithm symrig"};
}

/// Numbers of a leaf that a pass over the photographs works on.
std::vector<std::int64_t> costs_to_polish(const TransportTensor& whole) {
  std::vector<std::int64_t> costs;
  costs.reserve(whole.leaves().size());
  for (const Leaf& leaf : whole.leaves())
    costs.push_back(static_cast<std::int64_t>(leaf.values(whole.channels())));
  return costs;
}

}  // namespace

Result<PolishParts> PolishParts::of(const TransportTensor& whole, int ranks, int parts) {
  SYMRIG_CHECK(check_polishable(whole));
  PolishParts dealt(ranks, whole.channels());
  dealt.at_ = whole.scalars();
  dealt.values_ = whole.scalar_values();
  dealt.band_begin_ = dealt.at_.size();
  dealt.add_band(whole);
  dealt.leaves_ = deal(costs_to_polish(whole), 0, parts);
  const auto count = static_cast<std::size_t>(parts);
  for (std::size_t part = 0; part < count; ++part)
    dealt.entries_.push_back(
        {begin_of(dealt.at_.size(), part, count), begin_of(dealt.at_.size(), part + 1, count)});
  return dealt;
}

/// An entry of the band that is 0 was never measured.
void PolishParts::add_band(const TransportTensor& whole) {
  const std::vector<BandLeaf> bands = whole.bands();
  if (bands.empty()) return;
  const BandLeaf& band = bands[0];
  band_radius_ = band.radius;
  const Grid grid = whole.camera_grid();
  const auto pixels = static_cast<std::size_t>(grid.size());
  const std::vector<BandOffset> offsets = band_offsets(band.radius);
  std::vector<std::int32_t> in_tree(pixels);
  const auto order = whole.camera_tree().order();
  for (std::size_t t = 0; t < pixels; ++t)
    in_tree[static_cast<std::size_t>(order[t])] = static_cast<std::int32_t>(t);
  const auto channels = static_cast<std::size_t>(whole.channels());
  const auto value = [&](std::size_t place, std::size_t channel) {
    return band.values[channel * offsets.size() * pixels + place];
  };
  for (std::size_t k = 0; k < offsets.size(); ++k)
    for (std::size_t i = 0; i < pixels; ++i) {
      const std::size_t place = k * pixels + i;
      bool stored = false;
      for (std::size_t channel = 0; channel < channels; ++channel) stored |= value(place, channel) != 0;
      if (!stored) continue;
      const auto other = static_cast<std::size_t>(static_cast<std::int64_t>(i) +
                                                  std::int64_t{offsets[k].dy} * grid.cols + offsets[k].dx);
      at_.push_back({in_tree[i], in_tree[other]});
      band_places_.push_back(place);
      for (std::size_t channel = 0; channel < channels; ++channel) values_.push_back(value(place, channel));
    }
}

LeafRange PolishParts::of_rank(int rank) const {
  const auto r = static_cast<std::size_t>(rank), ranks = static_cast<std::size_t>(ranks_);
  return {begin_of(count(), r, ranks), begin_of(count(), r + 1, ranks)};
}

int PolishParts::rank_of(std::size_t part) const {
  int rank = 0;
  while (of_rank(rank).end <= part) ++rank;
  return rank;
}

Result<std::vector<KnownTransport>> PolishParts::read(const TransportTensor& whole, int rank) const {
  const LeafRange mine = of_rank(rank);
  const auto channels = static_cast<std::size_t>(whole.channels());
  std::vector<KnownTransport> parts;
  parts.reserve(mine.end - mine.begin);
  for (std::size_t part = mine.begin; part < mine.end; ++part)
    parts.emplace_back(whole.camera_tree(), whole.channels());
  std::size_t leaf_number = 0, part = mine.begin;
  SYMRIG_CHECK(whole.visit_leaves([&](const Leaf& leaf, std::span<const float> factors) {
    while (part < mine.end && leaf_number >= leaves_[part].end) ++part;
    if (part < mine.end && leaf_number >= leaves_[part].begin)
      add_leaf(parts[part - mine.begin], leaf, factors, whole.channels());
    ++leaf_number;
  }));
  for (part = mine.begin; part < mine.end; ++part)
    for (std::size_t k = entries_[part].begin; k < entries_[part].end; ++k)
      parts[part - mine.begin].add_scalar(at_[k].row, at_[k].col,
                                          std::span(values_).subspan(k * channels, channels));
  return parts;
}

std::vector<float> PolishParts::numbers(const KnownTransport& known) const {
  std::vector<float> all;
  all.reserve(known.factors().size() + known.scalar_values().size());
  const auto leaves = known.leaves();
  for (std::size_t first = 0, next = 0; first < leaves.size(); first = next) {
    for (next = first + 1; next < leaves.size() && leaves[next].joined;) ++next;
    append_factors(known, leaves.subspan(first, next - first), channels_, all);
  }
  all.insert(all.end(), known.scalar_values().begin(), known.scalar_values().end());
  return all;
}

std::size_t PolishParts::number_count(const TransportTensor& whole, std::size_t part) const {
  std::size_t numbers = (entries_[part].end - entries_[part].begin) * static_cast<std::size_t>(channels_);
  for (std::size_t k = leaves_[part].begin; k < leaves_[part].end; ++k)
    numbers += whole.leaves()[k].values(channels_);
  return numbers;
}

PolishParts::Assembly::Assembly(const PolishParts& parts, const TransportTensor& whole)
    : parts_(parts), whole_(whole), builder_(whole.camera_tree(), whole.channels()) {
  builder_.pack_leaves();
}

void PolishParts::Assembly::add(std::size_t part, std::span<const float> numbers) {
  for (std::size_t k = parts_.leaves_[part].begin; k < parts_.leaves_[part].end; ++k) {
    const Leaf& leaf = whole_.leaves()[k];
    const std::size_t size = leaf.values(whole_.channels());
    builder_.add_leaf(leaf.row_begin, leaf.row_end, leaf.col_begin, leaf.col_end, leaf.rank, leaf.level,
                      numbers.first(size));
    numbers = numbers.subspan(size);
  }
  entries_.insert(entries_.end(), numbers.begin(), numbers.end());
}

TransportTensor PolishParts::Assembly::finish() && {
  const auto channels = static_cast<std::size_t>(whole_.channels());
  const std::span<const float> values(entries_);
  for (std::size_t k = 0; k < parts_.band_begin_; ++k)
    builder_.add_scalar(parts_.at_[k].row, parts_.at_[k].col, values.subspan(k * channels, channels));
  for (int level = 0; level < whole_.levels(); ++level)
    for (const EmptyLeaf& empty : whole_.empties(level))
      builder_.add_empty(level, empty.row_block, empty.col_block);
  if (parts_.band_radius_ > 0) {
    const std::size_t plane =
        band_offsets(parts_.band_radius_).size() * static_cast<std::size_t>(whole_.camera_grid().size());
    std::vector<float> band(channels * plane);
    for (std::size_t k = 0; k < parts_.band_places_.size(); ++k)
      for (std::size_t channel = 0; channel < channels; ++channel)
        band[channel * plane + parts_.band_places_[k]] =
            values[(parts_.band_begin_ + k) * channels + channel];
    builder_.add_band(parts_.band_radius_, band);
  }
  return std::move(builder_).finish();
}

namespace {

using acquisition::Checks;
using acquisition::LogRange;

constexpr std::int64_t kFirst = 1;  ///< of the held-out photographs: the flood-lit one comes before them

/// Finds the held-out photographs of a scene in a log.
class Finder {
 public:
  Finder(const PhotographLog& log, const StoredScene& scene, std::string log_path, std::string scene_path)
      : log_(log), scene_(scene), log_path_(std::move(log_path)), scene_path_(std::move(scene_path)) {}

  Result<void> check_shape() const {
    const TransportTensor& t = scene_.tensor;
    if (log_.camera_grid() != log_.grid())
      return Error{
          ErrorCode::bad_value,
          fmt::format("the log keeps the camera's own photographs of {}, and polish needs those on the "
                      "cells",
                      to_string(log_.camera_grid())),
          "polish a registered rig during its capture: symrig capture --polish"};
    if (log_.grid() != t.camera_grid() || log_.channels() != t.channels())
      return other(fmt::format("its photographs are {} with {} channels, those of the scene {} with {}",
                               to_string(log_.grid()), log_.channels(), to_string(t.camera_grid()),
                               t.channels()));
    const auto taken = report::CaptureFacts(scene_.capture_json).number("/patterns");
    if (taken && *taken != static_cast<double>(log_.size()))
      return other(fmt::format("it has {} photographs, the capture took {:.0f}", log_.size(), *taken));
    return {};
  }

  /// The first `count` of the held-out photographs from `first` on are those of the log from `number` on.
  Result<void> check(std::int64_t number, std::size_t first, std::int64_t count) const {
    if (number + count > log_.size()) return missing();
    for (std::int64_t k = 0; k < count; ++k) {
      const HeldOut& held_out = scene_.held_out[first + static_cast<std::size_t>(k)];
      SYMRIG_TRY(const bool there, is(number + k, held_out));
      if (!there)
        return other(
            fmt::format("its photograph {} is not the held-out one '{}'", number + k, held_out.name));
    }
    return {};
  }

  /// Where a pattern comes next.
  Result<std::int64_t> next(const Image<float>& pattern, std::int64_t from) const {
    for (std::int64_t k = from; k < log_.size(); ++k) {
      SYMRIG_TRY(const Pattern shown, log_.pattern(k));
      if (shown == pattern) return k;
    }
    return missing();
  }

  /// The last flood-lit photographs in a row, but for the very first of the capture.
  Result<LogRange> last_flood_lit() const {
    LogRange last{0, 0};
    for (std::int64_t k = log_.size(); k-- > kFirst;) {
      SYMRIG_TRY(const Pattern shown, log_.pattern(k));
      const bool flood =
          std::all_of(shown.values().begin(), shown.values().end(), [](float v) { return v == 1; });
      if (flood) last = {k, last.last > 0 ? last.last : k + 1};
      if (!flood && last.last > 0) break;
    }
    return last;
  }

 private:
  /// Pixels that are not valid are kept as 0 (to_tree).
  Result<bool> is(std::int64_t number, const HeldOut& held_out) const {
    LoggedPhotograph logged;
    SYMRIG_CHECK(log_.read(number, logged));
    if (logged.pattern != held_out.pattern) return false;
    const auto kept = held_out.photograph.values();
    for (std::size_t at = 0; at < kept.size(); ++at) {
      const bool valid = logged.photograph.valid.values()[at] != 0;
      if (kept[at] != (valid ? logged.photograph.mean.values()[at] : 0.F)) return false;
    }
    return true;
  }

  Error missing() const { return other("a held-out photograph is missing"); }
  Error other(const std::string& why) const {
    return {ErrorCode::bad_value, fmt::format("{} is not the log of {}: {}", log_path_, scene_path_, why),
            "give the log that this capture has kept (capture --keep-log)"};
  }

  const PhotographLog& log_;
  const StoredScene& scene_;
  std::string log_path_, scene_path_;
};

}  // namespace

Result<CapturePhotographs> open_photographs(const std::string& path, const StoredScene& scene,
                                            const std::string& scene_path) {
  constexpr auto kSix = static_cast<std::size_t>(Checks::kCount), kFour = std::size_t{Checks::kFurther};
  const std::size_t kept = scene.held_out.size();
  if (kept < kSix || (kept - kSix) % kFour != 0)
    return Error{ErrorCode::bad_value,
                 fmt::format("{} has no held-out photographs, so nobody could tell what polish does to its "
                             "errors",
                             scene_path),
                 "polish captures of the algorithm symrig that brute force did not end"};
  CapturePhotographs found;
  SYMRIG_TRY(found.log, read_photograph_log(path));
  const Finder finder(*found.log, scene, path, scene_path);
  SYMRIG_CHECK(finder.check_shape());
  found.held_out = {kFirst, kFirst + Checks::kCount};
  std::vector<LogRange> left_out{found.held_out};
  SYMRIG_CHECK(finder.check(kFirst, 0, Checks::kCount));
  std::int64_t next = found.held_out.last;
  for (std::size_t set = kSix; set < kept; set += kFour) {
    SYMRIG_TRY(const std::int64_t at, finder.next(scene.held_out[set].pattern, next));
    next = at + Checks::kFurther;
    SYMRIG_CHECK(finder.check(at, set, Checks::kFurther));
    found.further.push_back({at, next});
    left_out.push_back({at, next});
  }
  SYMRIG_TRY(found.flood_lit, finder.last_flood_lit());
  found.used = acquisition::remaining(std::move(left_out), found.log->size());
  return found;
}

}  // namespace symrig::mpi
