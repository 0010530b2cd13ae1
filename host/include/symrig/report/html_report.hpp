// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/evaluate.hpp"
#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/report/made.hpp"
#include "symrig/tensor/file.hpp"

#include <string>

namespace symrig {

struct ReportOptions {
  std::string title = {};     ///< name of the scene file, as the reader knows it
  TrueTransport truth = {};   ///< may be empty: then nothing is compared
  std::string no_truth = {};  ///< why there is no truth, for the reader; may be empty
  Progress progress = {};     ///< may be empty; one event a section
  Made made = {};             ///< the page itself
};

/// One self-contained HTML page (pictures as data URIs, inline CSS and SVG, no script, no request): what the
/// scene looks like under a few lights, beside ground truth where it is known, what the transport looks like
/// inside [Garg06 Fig. 2c, 2d, 9, 11], what it cost, and the errors of TransportErrors.
/// fails: whatever truth fails with; interrupted.
Result<std::string> html_report(const StoredScene& scene, const ReportOptions& options);

}  // namespace symrig
