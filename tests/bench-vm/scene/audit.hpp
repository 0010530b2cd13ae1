// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bench-vm/scene/truth_log.hpp"
#include "sim/image_formation.hpp"
#include "symrig/acquisition/photograph_log.hpp"
#include "symrig/base/result.hpp"

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace symrig::bench_vm {

/// The auditor's knowledge about the capture.
struct AuditOptions {
  std::int64_t first_frame = 0;  ///< as for bench_scene
  std::size_t exposures = 4;     ///< frames per photograph
  std::size_t blacks = 8;        ///< dark photographs whose mean is the rig's black
  /// Frames of a photograph need not follow each other: of a rig with bit planes, which takes single frames
  /// again.
  bool scattered = false;
  /// A photograph is right if its distance to the true frames' photograph is below this. [rms over the
  /// pixels, in sigmas of the photograph's own noise]
  double limit = 0.2;
};

/// The result for one photograph.
struct AuditedPhotograph {
  double distance = 0;  ///< to the nearest bracket that was exposed with its pattern; < 0: there is none
  std::uint64_t first_frame = 0;  ///< of that bracket
};

struct Audit {
  std::vector<AuditedPhotograph> photographs;
  std::int64_t wrong = 0;     ///< farther than the limit from every bracket
  std::int64_t unseen = 0;    ///< no exposure had its pattern
  double farthest_right = 0;  ///< largest distance within the limit
  /// Proves that the limit detects wrong frames: each right photograph again, with one frame from another
  /// bracket.
  std::int64_t planted = 0;
  std::int64_t found = 0;     ///< farther than the limit
  std::int64_t harmless = 0;  ///< not detected, but the photograph changed by less than a tenth of the limit
};

/// Checks each photograph of a capture's log from outside the product. Noise is a function of a frame's
/// number, so the true frames can be made again, merged and compared. Then one wrong frame shifts a
/// photograph by about its noise: a frame of another pattern, of another exposure, or of another take of the
/// same pattern.
///
/// The rig divides by its estimate of the lamp level, which the references' noise changes by some
/// thousandths. So a factor within a hundredth of 1 is fitted to each photograph. The rig's black is the mean
/// of dark brackets at the begin of the session.
/// fails: as PhotographLog::read and merge; size_mismatch (the log is of another camera).
Result<Audit> audit(const PhotographLog& log, std::span<const TrueExposure> truth,
                    const sim::ImageFormation& formation, const AuditOptions& options);

}  // namespace symrig::bench_vm
