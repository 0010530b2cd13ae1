// SPDX-License-Identifier: Apache-2.0
#include "capture_photographs.hpp"

#include "acquisition/errors/checks.hpp"
#include "report/capture_facts.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>

namespace symrig::mpi {
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
