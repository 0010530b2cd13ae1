// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/error_estimate.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/report/summary.hpp"
#include "symrig/tensor/file.hpp"

#include <optional>
#include <string>

namespace symrig {

/// What a page shows of T on the camera's own pixels.
struct OwnPixelsShown {
  TrueTransport relit = {};  ///< the picture of a light, in colour if the camera has a mosaic
  TrueTransport truth = {};  ///< the same by the true transport; 0 where no row is; empty: not known
  std::optional<ErrorEstimate> errors = {};  ///< against that truth
};

struct ReportOptions {
  std::string title = {};                         ///< name of the scene file, for the reader
  TrueTransport truth = {};                       ///< if empty, nothing is compared
  std::optional<OwnPixelsShown> own_pixels = {};  ///< of a scene with such pixels: pictures are theirs
  std::string no_truth = {};                      ///< why there is no truth, for the reader; may be empty
  Progress progress = {};                         ///< may be empty; one event for each section
  Made made = {};                                 ///< date, version and command of the page
};

/// One self-contained HTML page (pictures as data URIs, inline CSS and SVG, no script, no request). It shows
/// the scene under a few lights, on the camera's own pixels if it has them, beside the truth if that is
/// known; the transport inside [Garg06 Fig. 2c, 2d, 9, 11]; the cost; and the errors of TransportErrors.
/// fails: as truth; interrupted.
Result<std::string> html_report(const StoredScene& scene, const ReportOptions& options);

}  // namespace symrig
