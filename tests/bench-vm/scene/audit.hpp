// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bench-vm/scene/truth_file.hpp"
#include "sim/studio.hpp"
#include "symrig/acquisition/photograph_log.hpp"
#include "symrig/base/result.hpp"

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace symrig::bench_vm {

/// What the auditor must know of the capture.
struct AuditOptions {
  std::int64_t first_frame = 0;  ///< as bench_scene's
  std::size_t exposures = 4;     ///< frames a photograph
  std::size_t blacks = 8;        ///< dark photographs that the rig's black is the mean of
  /// A photograph is right if it lies nearer than this to what the true frames make [sigmas, rms over the
  /// pixels, of the photograph's own noise].
  double limit = 0.2;
};

/// What became of one photograph.
struct AuditedPhotograph {
  double distance =
      0;  ///< from the nearest bracket that was truly exposed with its pattern; < 0: there is none
  std::uint64_t first_frame = 0;  ///< of that bracket
};

struct Audit {
  std::vector<AuditedPhotograph> photographs;
  std::int64_t wrong = 0;     ///< farther than the limit from every bracket
  std::int64_t unseen = 0;    ///< no exposure ever saw the pattern
  double farthest_right = 0;  ///< largest distance of those within the limit
  /// The proof that the limit finds wrong frames: each right photograph again with one of its frames taken
  /// from another bracket.
  std::int64_t planted = 0;
  std::int64_t found = 0;     ///< farther than the limit
  std::int64_t harmless = 0;  ///< not found, and the photograph is the same to a tenth of the limit
};

/// Takes each photograph of a capture's log apart from outside the product: noise is a function of a frame's
/// number, so the frames that were truly exposed can be made again, merged, and compared. A photograph with
/// one frame of another pattern, another exposure or another shot of the same pattern is off by its noise.
///
/// The rig divides by its estimate of the lamp, which its references' noise moves by some thousandths: a
/// factor within a hundredth of 1 is fitted to each photograph. The black that the rig subtracted is the mean
/// of dark brackets that the session began with. fails: as PhotographLog::read and merge.
Result<Audit> audit(const PhotographLog& log, std::span<const TrueExposure> truth, const sim::Studio& studio,
                    const AuditOptions& options);

/// Opens a log of whatever capture.  fails: as open_photograph_log, bad_format.
Result<std::unique_ptr<PhotographLog>> open_any_log(const std::string& path);

}  // namespace symrig::bench_vm
