// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/search/log_range.hpp"
#include "symrig/acquisition/photograph_log.hpp"
#include "symrig/acquisition/probe.hpp"
#include "symrig/base/result.hpp"
#include "symrig/tensor/file.hpp"

#include <memory>
#include <string>
#include <vector>

namespace symrig::mpi {

/// The photographs of a capture that has ended, by their log numbers.
struct CapturePhotographs {
  std::unique_ptr<const PhotographLog> log;
  acquisition::LogRange held_out{0, 0};             ///< the first six
  std::vector<acquisition::LogRange> further = {};  ///< sets of four
  acquisition::LogRange flood_lit{0, 0};            ///< those at the end
  std::vector<acquisition::LogRange> used = {};     ///< all but the held-out ones
};

/// Opens the log of a scene. That it is the scene's log shows in the held-out photographs: all of them must
/// be in it, bit for bit. fails: as read_photograph_log; bad_value (another capture's log, or a scene without
/// held-out photographs).
Result<CapturePhotographs> open_photographs(const std::string& path, const StoredScene& scene,
                                            const std::string& scene_path);

/// The rig of a capture that has ended: its photographs are in the log.
class EndedRig final : public Probe {
 public:
  explicit EndedRig(const PhotographLog& log) : log_(log) {}
  Grid grid() const override { return log_.grid(); }
  int channels() const override { return log_.channels(); }
  Result<std::vector<Radiance>> measure(std::span<const Pattern>) override {
    return Error{ErrorCode::bad_argument, "this capture has ended", "capture again"};
  }
  ProbeCost cost() const override { return {}; }
  std::string describe() const override { return "the rig of a capture that has ended"; }

 private:
  const PhotographLog& log_;
};

}  // namespace symrig::mpi
