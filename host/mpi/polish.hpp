// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/refine/polish.hpp"
#include "polish_parts.hpp"
#include "ranks.hpp"
#include "symrig/acquisition/error_estimate.hpp"
#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/tensor/file.hpp"

#include <cstdint>
#include <string>

namespace symrig::mpi {

struct PolishJob {
  std::string scene, log;
  int steps = 2;  ///< at most; as many as `symrig capture` takes by itself
  int parts = 0;  ///< of T (PolishParts): at least as many as ranks; 0: as many
};

struct Polished {
  StoredScene scene;  ///< on the first rank: polished, with its errors in capture_json
  ErrorEstimate errors;
  int parts = 0;
  int steps = 0;                 ///< taken
  double before = 0, after = 0;  ///< weighted misfit (Polish)
  std::int64_t photographs = 0;  ///< that it was refitted to
};

/// Refits all of T to all photographs of its capture but the held-out ones (acquisition::Polish), and
/// estimates its errors as a capture does. The leaves are dealt over the ranks, and every rank reads the log.
/// With the same number of parts, the result has the same bits for any number of ranks. One rank with one
/// part is the polish of a capture. The first rank gathers T: it holds the packed leaves of all ranks, and
/// the numbers of one part.
/// fails: as load_scene, open_photographs and PolishParts::of on any rank (the text names it); bad_argument
/// (steps, parts); bad_value (the ranks read different files; a scene that does not state its tolerance);
/// interrupted.
Result<Polished> polish(const Ranks& ranks, const PolishJob& job, const Progress& progress = {});

/// On another rank, when the first one has asked for it: its part of polish().
void help_polish(const Ranks& ranks);

/// The ranks as what a polish is dealt over.
class RankTeam final : public acquisition::PolishTeam {
 public:
  /// progress: of the first rank; asked at each exchange.
  RankTeam(const Ranks& ranks, const PolishParts& parts, const Progress& progress)
      : ranks_(ranks), parts_(parts), progress_(progress) {}

  std::size_t parts() const override { return parts_.count(); }
  std::size_t first() const override { return parts_.of_rank(ranks_.rank()).begin; }
  void add_up(std::span<double> values) const override { ranks_.add_up_for_all(values); }
  Result<void> all(const Result<void>& mine) const override;

 private:
  const Ranks& ranks_;
  const PolishParts& parts_;
  const Progress& progress_;
  mutable std::int64_t exchanges_ = 0;
};

}  // namespace symrig::mpi
