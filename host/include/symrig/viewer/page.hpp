// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/grid.hpp"
#include "symrig/tensor/file.hpp"

#include <cstdint>
#include <string>

namespace symrig {

/// The largest page that export_page() writes, unless the caller says otherwise. units: bytes.
inline constexpr std::int64_t kMaxExport = 50'000'000;

struct ExportOptions {
  std::string title;                    ///< the heading of the page
  std::int64_t max_bytes = kMaxExport;  ///< a scene that takes more is reduced
};

/// One HTML file that relights a scene in any browser. It holds T on the projector's cells only.
struct ExportedPage {
  std::string html;
  Grid camera, projector;  ///< the grids of the page
  bool reduced = false;    ///< they are smaller than the scene's
};

/// The page with the tensor and the kernel in it. It opens from a file and loads nothing.
/// error: factors and entries are rounded as in a finished tensor; measured columns to 2⁻¹¹ of a value + 2⁻³²
/// of the channel's largest. A page larger than max_bytes gets half the rows and columns, as often as needed.
/// fails: limit (the smallest page is larger than max_bytes, or the scene cannot be reduced).
Result<ExportedPage> export_page(const StoredScene& scene, const ExportOptions& options);

}  // namespace symrig
