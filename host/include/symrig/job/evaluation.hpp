// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/error_estimate.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/acquisition/probe.hpp"
#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/calibration/registered_probe.hpp"
#include "symrig/report/html_report.hpp"
#include "symrig/report/summary.hpp"
#include "symrig/tensor/camera_transport.hpp"
#include "symrig/tensor/file.hpp"
#include "symrig/tensor/transport_operator.hpp"

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace symrig {

/// The errors of a tensor against a rig, and the rig's own description.
struct Judged {
  ErrorEstimate errors;
  std::string rig;
  /// If `errors` refer to T of a bench: those against T of the ideal coaxial rig.
  std::optional<ErrorEstimate> ideal = {};
};

/// Compares with the true transport of a `sim:` rig. progress: one step for each pattern; may be empty.
/// fails: as open_truth; size_mismatch (the rig of another scene); interrupted.
Result<Judged> judge_by_truth(const TransportOperator& tensor, const std::string& rig,
                              const Progress& progress);

/// The true transport behind a scene, if it was captured from a simulated rig that fits it; otherwise empty.
TrueTransport true_transport_of(const StoredScene& scene);

/// Compares with new photographs of a rig. progress: one step for each photograph; may be empty.
/// fails: as check_aligned and Probe::measure; size_mismatch (the rig of another scene); interrupted.
Result<Judged> judge_by_rig(const TransportOperator& tensor, Probe& rig, const Progress& progress);

/// Compares T on the camera's own pixels with the true transport of a `sim:` bench, seen by its exact map.
/// fails: as judge_by_truth; size_mismatch (a rig without such a camera).
Result<ErrorEstimate> judge_camera_by_truth(const CameraTransport& camera, const std::string& rig,
                                            const Progress& progress);

/// The same with new photographs of a registered rig. fails: as judge_by_rig; bad_argument (another
/// registration than that of the capture).
Result<ErrorEstimate> judge_camera_by_rig(const CameraTransport& camera, RegisteredProbe& rig,
                                          const Progress& progress);

/// What a report shows beside the tensor: the camera's own pixels, and the truth of both if the scene was
/// captured from a simulated rig; or why there is none. options.progress: as judge_by_truth. fails:
/// interrupted; unknown_name (a mosaic).
Result<void> add_truths(const StoredScene& scene, ReportOptions& options);

/// Compares with photographs that the scene file has kept, one result each.
/// fails: size_mismatch.
Result<std::vector<HeldOutError>> judge_by_photographs(const TransportOperator& tensor,
                                                       std::span<const HeldOut> held_out);
/// The same with all of them.
Result<std::vector<HeldOutError>> judge_by_photographs(const StoredScene& scene);

}  // namespace symrig
