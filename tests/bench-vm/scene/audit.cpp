// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/audit.hpp"

#include "symrig/base/statistics.hpp"
#include "symrig/hdr/merge.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <numeric>
#include <unordered_map>
#include <utility>

#include <fmt/format.h>

namespace symrig::bench_vm {

namespace {

using FrameCodes = std::vector<std::uint16_t>;
constexpr double kHarmless = 0.1;    // of the limit
constexpr double kLampError = 0.01;  // the bench's lamp is stable, so a larger error is not an estimate of it
constexpr std::size_t kDarkBrackets = 4;    // this many dark brackets in a row: a session begins
constexpr std::size_t kMostDark = 12;       // tries only the last ones of a session
constexpr std::size_t kWitnesses = 15;      // photographs that distinguish two blacks
constexpr double kSameTime = 0.02;          // of two exposures in equal places of their brackets
constexpr std::size_t kApart = 200;         // exposures: a photograph is taken again at the latest
constexpr std::size_t kMostChoices = 4096;  // of frames for a photograph

/// A complete bracket exposed with one picture, and the photograph merged from its frames, including black.
struct Bracket {
  std::vector<std::size_t> taken;  // indices into the list of true exposures
  int session = 0;                 // number of sessions that began before it
  std::vector<FrameCodes> codes;
  Radiance photograph;
};

/// The pattern as a screen with eight bits per colour shows it.
Image<float> on_screen(const Pattern& pattern) {
  Image<float> shown = pattern;
  for (float& value : shown.values())
    value = static_cast<float>(static_cast<double>(std::lround(value * 255.F)) / 255.0);
  return shown;
}

/// A merged photograph as the rig logs it, but for the lamp: without black.
Radiance as_logged(Radiance photograph, const Radiance& black) {
  const auto mean = photograph.mean.values(), variance = photograph.variance.values();
  const auto valid = photograph.valid.values();
  for (std::size_t i = 0; i < valid.size(); ++i) {
    valid[i] = valid[i] != 0 && black.valid.values()[i] != 0 ? 1 : 0;
    mean[i] = valid[i] != 0 ? mean[i] - black.mean.values()[i] : 0;
    variance[i] = valid[i] != 0 ? variance[i] + black.variance.values()[i] : 0;
  }
  return photograph;
}

class Auditor {
 public:
  Auditor(std::span<const TrueExposure> truth, const sim::ImageFormation& formation,
          const AuditOptions& options)
      : truth_(truth), formation_(formation), options_(options) {
    for (std::size_t i = 0; i + options.exposures <= truth.size(); ++i)
      if (is_bracket(i)) brackets_[truth[i].picture].push_back(in_a_row(i));
    number_sessions();
    if (options.scattered) gather_scattered();
  }

  Grid camera() const { return formation_.camera(); }

  /// Of a rig that subtracts none.
  Radiance no_black() const {
    const Grid camera = formation_.camera();
    return {Image<float>(camera), Image<float>(camera), Image<std::uint8_t>(camera, 1, 1)};
  }

  /// The last dark brackets at the begin of a session.
  Result<std::vector<Radiance>> dark_photographs(int session) const {
    std::vector<Radiance> photographs;
    const auto found = dark_.find(session);
    if (found == dark_.end()) return photographs;
    const auto light = dark_light();
    const std::vector<std::size_t>& begins = found->second;
    for (std::size_t k = begins.size() - std::min(begins.size(), kMostDark); k < begins.size(); ++k) {
      SYMRIG_TRY(Bracket bracket, expose(in_a_row(begins[k]), light));
      photographs.push_back(std::move(bracket.photograph));
    }
    return photographs;
  }

  /// Every bracket that was exposed with this pattern.
  Result<std::vector<Bracket>> brackets_of(const Pattern& pattern) const {
    const Image<float> shown = on_screen(pattern);
    const auto found = brackets_.find(picture_key(shown));
    std::vector<Bracket> brackets;
    if (found == brackets_.end()) return brackets;
    const auto light = formation_.light_of(shown, 0);
    for (const Taken& taken : found->second) {
      SYMRIG_TRY(Bracket bracket, expose(taken, light));
      brackets.push_back(std::move(bracket));
    }
    return brackets;
  }

  Result<Radiance> merged(const std::vector<std::size_t>& taken, std::span<const FrameCodes> codes) const {
    std::vector<Frame> frames;
    for (std::size_t j = 0; j < codes.size(); ++j) frames.push_back({codes[j], truth_[taken[j]].lit()});
    MergeOptions merging;
    merging.scale = formation_.scale();
    return merge(frames, formation_.camera(), 1, formation_.noise(), merging);
  }

 private:
  using Taken = std::vector<std::size_t>;

  Taken in_a_row(std::size_t first) const {
    Taken taken(options_.exposures);
    std::iota(taken.begin(), taken.end(), first);
    return taken;
  }
  sim::ImageFormation::Light dark_light() const {
    return formation_.light_of(Image<float>(formation_.cells(), 1), 0);
  }

  bool have_same_times(const Taken& a, const Taken& b) const {
    for (std::size_t j = 0; j < a.size(); ++j)
      if (std::abs(seconds(truth_[a[j]].lit()) / seconds(truth_[b[j]].lit()) - 1) >= kSameTime) return false;
    return true;
  }

  /// The bracket of a session whose times most pictures have: metering takes others, of one picture. Empty:
  /// the session has none.
  Taken usual_bracket(int session) const {
    Taken usual;
    std::ptrdiff_t most = 0;
    for (const auto& [picture, brackets] : brackets_)
      for (const Taken& one : brackets) {
        if (session_[one.front()] != session) continue;
        const auto alike = std::ranges::count_if(brackets_, [&](const auto& other) {
          return std::ranges::any_of(other.second, [&](const Taken& taken) {
            return session_[taken.front()] == session && have_same_times(one, taken);
          });
        });
        if (alike <= most) continue;
        most = alike;
        usual = one;
      }
    return usual;
  }

  /// All choices of one frame for each place in the bracket, for each picture. The place of a frame follows
  /// from its time: all brackets of a session have the same, as the session metered them.
  void gather_scattered() {
    std::unordered_map<std::uint64_t, std::vector<Taken>> all;
    for (int session = 0; !session_.empty() && session <= session_.back(); ++session)
      for (const auto& [picture, places] : places_in(session)) {
        const auto some = choices(places);
        all[picture].insert(all[picture].end(), some.begin(), some.end());
      }
    brackets_ = std::move(all);
  }

  /// For each picture of a session: the frames that may be in each place of a bracket.
  std::unordered_map<std::uint64_t, std::vector<Taken>> places_in(int session) const {
    std::unordered_map<std::uint64_t, std::vector<Taken>> places;
    const Taken known = usual_bracket(session);
    for (std::size_t i = 0; i < truth_.size() && !known.empty(); ++i) {
      if (!truth_[i].pure || session_[i] != session) continue;
      auto& of_picture = places[truth_[i].picture];
      of_picture.resize(known.size());
      for (std::size_t j = 0; j < known.size(); ++j)
        if (std::abs(seconds(truth_[i].lit()) / seconds(truth_[known[j]].lit()) - 1) < kSameTime)
          of_picture[j].push_back(i);
    }
    return places;
  }

  /// The last ones first: what was taken again counts.
  static std::vector<Taken> choices(const std::vector<Taken>& places) {
    std::vector<Taken> all{{}};
    for (const Taken& place : places) {
      std::vector<Taken> longer;
      for (const Taken& begun : all)
        for (auto frame = place.rbegin(); frame != place.rend() && longer.size() < kMostChoices; ++frame) {
          if (!begun.empty() && std::max(*frame, begun.front()) - std::min(*frame, begun.front()) > kApart)
            continue;
          longer.push_back(begun);
          longer.back().push_back(*frame);
        }
      all = std::move(longer);
    }
    return {all.rbegin(), all.rend()};
  }

  void number_sessions() {
    const std::uint64_t dark = picture_key(Image<float>(formation_.cells(), 1));
    std::size_t row = 0;
    int sessions = 0;
    for (std::size_t i = 0; i < truth_.size(); ++i) {
      row = truth_[i].pure && truth_[i].picture == dark ? row + 1 : 0;
      if (row == kDarkBrackets * options_.exposures) {
        ++sessions;
        for (std::size_t k = i + 1 - row; k < i; ++k) note_dark(k, sessions);
      }
      if (row >= kDarkBrackets * options_.exposures) note_dark(i, sessions);
      session_.push_back(sessions);
    }
  }
  void note_dark(std::size_t first, int session) {
    if (first + options_.exposures <= truth_.size() && is_bracket(first)) dark_[session].push_back(first);
  }

  /// true: the exposures from `first` on show one picture and become longer, for a complete bracket. Equal
  /// ones that only jitter are guard frames, or check the planes.
  bool is_bracket(std::size_t first) const {
    for (std::size_t j = 0; j < options_.exposures; ++j) {
      const TrueExposure& exposure = truth_[first + j];
      if (!exposure.pure || exposure.picture != truth_[first].picture) return false;
      if (j > 0 && seconds(exposure.open) < (1 + kSameTime) * seconds(truth_[first + j - 1].open))
        return false;
    }
    return true;
  }

  Result<Bracket> expose(const Taken& taken, const sim::ImageFormation::Light& light) const {
    Bracket bracket{taken, session_[taken.front()], {}, {}};
    for (const std::size_t i : taken) {
      const TrueExposure& exposure = truth_[i];
      const sim::ImageFormation::Share shares[] = {{light, exposure.share},
                                                   {dark_light(), 1 - exposure.share}};
      bracket.codes.push_back(
          formation_.expose(exposure.share < 1 ? *formation_.during(shares) : *light, seconds(exposure.open),
                            static_cast<std::uint64_t>(options_.first_frame) + exposure.frame));
    }
    SYMRIG_TRY(bracket.photograph, merged(taken, bracket.codes));
    return bracket;
  }

  std::span<const TrueExposure> truth_;
  const sim::ImageFormation& formation_;
  const AuditOptions& options_;
  std::unordered_map<std::uint64_t, std::vector<Taken>> brackets_;  // by picture
  std::vector<int> session_;                                        // of each exposure
  std::map<int, std::vector<std::size_t>> dark_;                    // begins of dark brackets, by session
};

/// A logged photograph, and the brackets from which it may come.
struct Suspect {
  Radiance logged;
  std::vector<Bracket> brackets;
};

/// Visits the pixels that are valid in both photographs.
template <class Use>
void for_each_valid(const Radiance& again, const Radiance& logged, Use use) {
  for (std::size_t i = 0; i < logged.valid.values().size(); ++i)
    if (logged.valid.values()[i] != 0 && again.valid.values()[i] != 0) use(i);
}

/// Estimates the lamp level by which the rig divided the photograph, by least squares.
double lamp_of(const Radiance& again, const Radiance& logged) {
  double both = 0;
  double square = 0;
  for_each_valid(again, logged, [&](std::size_t i) {
    const double weight = 1.0 / logged.variance.values()[i];
    const double made = again.mean.values()[i];
    both += weight * made * logged.mean.values()[i];
    square += weight * made * made;
  });
  return both <= 0 ? 1 : std::clamp(square / both, 1 - kLampError, 1 + kLampError);
}

/// rms of (made again / lamp − logged) / σ over the valid pixels. A log of a camera's own pixels rounds what
/// the rig gives it: the lamp comes before.
double distance(Radiance again, const Radiance& logged, const PhotographLog& log) {
  const auto lamp = static_cast<float>(lamp_of(again, logged));
  for (float& v : again.mean.values()) v /= lamp;
  again = log.kept(std::move(again));
  double squares = 0;
  std::int64_t count = 0;
  for_each_valid(again, logged, [&](std::size_t i) {
    const double off = static_cast<double>(again.mean.values()[i]) - logged.mean.values()[i];
    squares += off * off / logged.variance.values()[i];
    ++count;
  });
  return count == 0 ? 0 : std::sqrt(squares / static_cast<double>(count));
}

using Blacks = std::map<int, Radiance>;  // by session

/// Median distance of a session's photographs with this black. If several brackets have a photograph's
/// pattern, the last one is most likely, because earlier ones were taken again.
double misfit(const PhotographLog& log, std::span<const Suspect> suspects, int session,
              const Radiance& black) {
  std::vector<double> distances;
  for (const Suspect& suspect : suspects) {
    if (distances.size() == kWitnesses) break;
    if (suspect.brackets.empty() || suspect.brackets.back().session != session) continue;
    distances.push_back(distance(as_logged(suspect.brackets.back().photograph, black), suspect.logged, log));
  }
  return median(distances);
}

/// The black that the rig subtracted in a session: the mean of options.blacks of its dark brackets. Some were
/// taken again, and which ones is unknown. So it tries all choices and takes the one with the smallest
/// misfit.
Result<Radiance> black_of(const Auditor& auditor, const PhotographLog& log, std::span<const Suspect> suspects,
                          int session, std::size_t blacks) {
  SYMRIG_TRY(const std::vector<Radiance> dark, auditor.dark_photographs(session));
  if (dark.empty() || blacks == 0) return auditor.no_black();
  std::vector<char> chosen(dark.size());
  std::fill_n(chosen.rbegin(), std::min(blacks, dark.size()), 1);
  Radiance best;
  double least = std::numeric_limits<double>::infinity();
  do {  // for every choice
    std::vector<Radiance> used;
    for (std::size_t k = 0; k < dark.size(); ++k)
      if (chosen[k] != 0) used.push_back(dark[k]);
    SYMRIG_TRY(Radiance black, average(used));
    const double away = misfit(log, suspects, session, black);
    if (away < least) least = away, best = std::move(black);
  } while (std::next_permutation(chosen.begin(), chosen.end()));
  return best;
}

Result<Blacks> blacks_of(const Auditor& auditor, const PhotographLog& log, std::span<const Suspect> suspects,
                         std::size_t count) {
  Blacks blacks;
  for (const Suspect& suspect : suspects)
    for (const Bracket& bracket : suspect.brackets) {
      if (blacks.contains(bracket.session)) continue;
      SYMRIG_TRY(blacks[bracket.session], black_of(auditor, log, suspects, bracket.session, count));
    }
  return blacks;
}

/// Finds the nearest bracket and moves it to the front.
AuditedPhotograph judge(const PhotographLog& log, Suspect& suspect, const Blacks& blacks,
                        std::span<const TrueExposure> truth) {
  AuditedPhotograph best{-1, 0};
  for (Bracket& bracket : suspect.brackets) {
    const double away =
        distance(as_logged(bracket.photograph, blacks.at(bracket.session)), suspect.logged, log);
    if (best.distance >= 0 && away >= best.distance) continue;
    best = {away, truth[bracket.taken.front()].frame};
    if (&bracket != &suspect.brackets.front()) std::swap(suspect.brackets.front(), bracket);
  }
  return best;
}

/// Replaces a frame of the bracket by frame j of `other`, and checks that the limit detects it.
Result<void> plant(const Auditor& auditor, const PhotographLog& log, const Suspect& suspect,
                   const Bracket& other, const Radiance& black, double limit, Audit& audit) {
  const Bracket& own = suspect.brackets.front();
  const Radiance right = as_logged(own.photograph, black);
  for (std::size_t j = 0; j < own.codes.size(); ++j) {
    std::vector<FrameCodes> codes = own.codes;
    codes[j] = other.codes[j];
    SYMRIG_TRY(Radiance merged, auditor.merged(own.taken, codes));
    const Radiance wrong = as_logged(std::move(merged), black);
    ++audit.planted;
    if (distance(wrong, suspect.logged, log) > limit)
      ++audit.found;
    else if (distance(wrong, right, log) < kHarmless * limit)
      ++audit.harmless;
  }
  return {};
}

/// All photographs of the log, each with the brackets from which it may come.
Result<std::vector<Suspect>> suspects_of(const PhotographLog& log, const Auditor& auditor) {
  std::vector<Suspect> suspects;
  for (std::int64_t k = 0; k < log.size(); ++k) {
    SYMRIG_TRY(const Pattern pattern, log.pattern(k));
    SYMRIG_TRY(Radiance photograph, log.photograph(k));
    SYMRIG_TRY(auto brackets, auditor.brackets_of(pattern));
    suspects.push_back({std::move(photograph), std::move(brackets)});
  }
  return suspects;
}

}  // namespace

Result<Audit> audit(const PhotographLog& log, std::span<const TrueExposure> truth,
                    const sim::ImageFormation& formation, const AuditOptions& options) {
  const Auditor auditor(truth, formation, options);
  if (log.camera_grid() != auditor.camera())
    return Error{ErrorCode::size_mismatch,
                 fmt::format("the log's photographs have {} pixels, but {} are expected",
                             to_string(log.camera_grid()), to_string(auditor.camera())),
                 "give the scene of the capture"};
  SYMRIG_TRY(std::vector<Suspect> suspects, suspects_of(log, auditor));
  SYMRIG_TRY(const Blacks blacks, blacks_of(auditor, log, suspects, options.blacks));
  Audit audit;
  for (Suspect& suspect : suspects) {
    audit.photographs.push_back(judge(log, suspect, blacks, truth));
  }
  for (std::size_t k = 0; k < suspects.size(); ++k) {
    const double away = audit.photographs[k].distance;
    audit.unseen += away < 0 ? 1 : 0;
    audit.wrong += away > options.limit ? 1 : 0;
    if (away < 0 || away > options.limit) continue;
    audit.farthest_right = std::max(audit.farthest_right, away);
    const Suspect& next = suspects[(k + 1) % suspects.size()];
    const Bracket& own = suspects[k].brackets.front();
    if (suspects.size() > 1 && !next.brackets.empty())
      SYMRIG_CHECK(plant(auditor, log, suspects[k], next.brackets.front(), blacks.at(own.session),
                         options.limit, audit));
  }
  return audit;
}

}  // namespace symrig::bench_vm
