// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/evaluate.hpp"
#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/report/summary.hpp"
#include "symrig/tensor/file.hpp"

#include <string>

namespace symrig {

struct ReportOptions {
  std::string title = {};     ///< name of the scene file, for the reader
  TrueTransport truth = {};   ///< if empty, nothing is compared
  std::string no_truth = {};  ///< why there is no truth, for the reader; may be empty
  Progress progress = {};     ///< may be empty; one event for each section
  Made made = {};             ///< date, version and command of the page
};

/// One self-contained HTML page (pictures as data URIs, inline CSS and SVG, no script, no request). It shows
/// the scene under a few lights, beside the truth if that is known; the transport inside [Garg06 Fig. 2c, 2d,
/// 9, 11]; the cost; and the errors of TransportErrors.
/// fails: as truth; interrupted.
Result<std::string> html_report(const StoredScene& scene, const ReportOptions& options);

}  // namespace symrig
