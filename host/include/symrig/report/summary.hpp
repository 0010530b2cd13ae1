// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/base/result.hpp"
#include "symrig/rig/rig.hpp"
#include "symrig/tensor/file.hpp"
#include "symrig/tensor/transport_operator.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace symrig {

/// How a file was made. Each part may be empty; it is then not reported.
struct Made {
  std::string date = {};          ///< UTC, as in 2026-01-31T23:59:58Z [ISO 8601]
  std::string version = {};       ///< of symrig
  std::string command_line = {};  ///< as typed into a shell
};

/// The time now, as Made::date has it; empty if the system does not know it.
std::string utc_now();

/// The differences between the scene of `rig` and the scene that a file was captured from (captured_scene();
/// rigs as in Probe::describe()). One text for each difference; none if the light transport is the same, or
/// if the file does not state its scene. For simulated rigs only the true transport counts: noise, exposures,
/// misalignment, flare, and a seed without texture make no difference.
std::vector<std::string> differences_of_scene(const std::string& captured, const std::string& rig);

/// What to warn of where errors are measured on another scene. of: the scene, such as "scene.h5". Empty: no
/// differences.
std::string other_scene_warning(const std::string& of, const std::vector<std::string>& differences);

/// The nodes of one level: leaves by kind, and nodes that were split into children.
struct NodeCounts {
  LeafCounts leaves;
  std::int64_t subdivided = 0;

  std::int64_t total() const {
    return leaves.rank1 + leaves.low_rank + leaves.empty + leaves.scalar + subdivided;
  }
};

/// One entry for each level of the deeper tree. It counts stored nodes: in a symmetric tensor each unordered
/// pair of blocks once. A node is subdivided if it contains a leaf of a deeper level. This is counted for
/// symmetric tensors only, because others do not grow level by level.
/// source: [Garg06 Fig. 9]
std::vector<NodeCounts> node_counts(const TransportTensor& tensor);

/// T on the camera's own pixels, as a capture made it.
struct CameraFacts {
  Grid grid;
  std::int64_t rows = 0;          ///< pixels that have one; each channel counts
  std::int64_t coefficients = 0;  ///< of all rows
  std::int64_t bytes = 0;
  double seconds = 0;  ///< that the fit took on the host
  /// From photographs that were held out; none: none were.
  std::optional<ErrorEstimate> errors = {};
  std::int64_t unjudged = 0;  ///< rows that the errors hold in part: CameraErrors::unjudged
};

/// The facts of `symrig capture --json` beside the tensor. Times are seconds on the host, unless stated.
struct CaptureSummary {
  std::string scene = {};  ///< the rig and its scene: Probe::describe()
  Algorithm algorithm = Algorithm::symrig;
  RankRule rule = {};         ///< as used
  double dual_threshold = 0;  ///< of Algorithm::dual
  double target_error = 0;    ///< that was asked for; 0: none
  std::string noise = {};     ///< "off" or "camera"
  ProbeCost cost = {};
  double measure_seconds = 0;          ///< waiting for photographs (simulation and merging included)
  double total_seconds = 0;            ///< from the start of the command to the finished tensor
  std::int64_t peak_memory_bytes = 0;  ///< largest resident size of the process so far
  std::int64_t replayed = 0;           ///< photographs from the log of an interrupted capture
  RigTrouble trouble = {};             ///< what went wrong with frames and devices, and was repaired
  std::optional<CameraFacts> camera = {};
  std::string camera_missing =
      {};  ///< why a camera with pixels of its own has none; "": it has no such pixels
  Made made = {};
};

/// The JSON of `symrig capture --json` (docs/command-line.md): one object, indented, ends with a newline.
std::string capture_json(const CaptureSummary& summary, const CaptureResult& result);

/// What a person must know of a finished capture, a sentence each: of its rig, its noise, its budget. Options
/// have the names of CaptureOptions.
std::vector<std::string> capture_warnings(const CaptureSummary& summary, const CaptureResult& result);

/// What exposures and devices of a rig warn of, a sentence each.
std::vector<std::string> rig_warnings(const RigTrouble& trouble);

/// The settings that determine the choice of patterns, as "name value" lines with the names of capture_json.
/// A capture can continue from a log only with the same settings (LogIdentity). Budgets are not included: a
/// continued capture may have others.
std::string settings_text(const CaptureSettings& settings);

/// The identity of a log of this capture, for create_photograph_log and open_photograph_log.
LogIdentity log_identity(const Probe& rig, const CaptureSettings& settings);

/// The prediction error of a held-out photograph. Radiance is in the units of the tensor.
struct HeldOutError {
  std::string name;
  double rms = 0;               ///< of prediction − photograph over lit pixels, all channels
  double mean_white = 0;        ///< mean flood-lit prediction over lit pixels
  std::int64_t lit_pixels = 0;  ///< camera pixels with a flood-lit prediction above a tenth of its mean
  /// The relative error: share of mean white (0 where nothing is lit).
  double relative() const { return mean_white > 0 ? rms / mean_white : 0; }
};

/// Predicts one held-out photograph and compares.
/// fails: size_mismatch.
Result<HeldOutError> held_out_error(const TransportOperator& tensor, const HeldOut& held_out);

/// The JSON of `symrig evaluate --json`. errors (no truth given) and half_width may be null. differs:
/// differences_of_scene(). ideal: errors against T of the ideal coaxial rig, if `errors` refer to that of a
/// bench. camera: errors on the camera's own pixels, or null.
std::string evaluation_json(const std::string& scene, const std::string& rig, const TransportErrors* errors,
                            const std::vector<HeldOutError>& held_out,
                            const TransportErrors* half_width = nullptr,
                            const std::vector<std::string>& differs = {},
                            const TransportErrors* ideal = nullptr, const ErrorEstimate* camera = nullptr);

/// The same errors without a scene file: rig, error, error_uncertainty, and error_ideal unless ideal is null.
std::string rig_errors_json(const std::string& rig, const TransportErrors& errors,
                            const TransportErrors& half_width, const TransportErrors* ideal);

/// What the capture has estimated, and the given errors of held-out photographs, as JSON: estimated_error,
/// estimated_error_uncertainty and estimated_error_not_given of capture_json (null if absent), and held_out
/// of evaluation_json.
std::string stored_errors_json(const StoredScene& scene, const std::vector<HeldOutError>& held_out);

/// The JSON of `symrig inspect --json`.
std::string inspection_json(const StoredScene& scene);

/// The `scene` key of a stored capture_json, empty if there is none.
std::string captured_scene(const StoredScene& scene);

/// Why a scene of a camera with pixels of its own has only the projector's cells, as its capture said; "": it
/// has them, or there are none to have.
std::string missing_pixels(const StoredScene& scene);

}  // namespace symrig
