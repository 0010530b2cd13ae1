// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/report/html_report.hpp"
#include "symrig/report/internal/json_text.hpp"
#include "symrig/report/summary.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace symrig::report {

/// A number of the file with its JSON pointer ("/patterns", "/a/1 - /a/0", "/a / /b").
struct Sourced {
  double value = 0;
  std::string from;
};

/// One stage of the capture, and the state of the tensor at its end.
struct Stage {
  std::string name;
  std::optional<int> level = {};            ///< the level of the hierarchy, if the stage is a level
  std::optional<Sourced> patterns = {};     ///< of this stage
  std::optional<Sourced> by_then = {};      ///< photographs up to the end of the stage
  std::optional<Sourced> rig_seconds = {};  ///< up to the end of the stage
  bool seconds_scaled = false;              ///< not in the file: computed in proportion to the photographs
  std::optional<Sourced> error = {};        ///< estimated frobenius error if the capture had ended here
  std::optional<Sourced> uncertainty = {};  ///< of the error, as in the file (±)
};

/// In the order of the capture; the last one is the finished tensor. Read leniently: values that are missing
/// or invalid (negative, above 1e15) are ignored. At most kMostStages.
std::vector<Stage> stages_of(const CaptureFacts& facts);
inline constexpr std::size_t kMostStages = 100;

/// The uncertainty of an estimated error. at: "" or "/camera". path: "/frobenius", as below /estimated_error.
std::optional<Sourced> uncertainty_at(const CaptureFacts& facts, const std::string& at,
                                      const std::string& path);

/// A valid number ≥ 0 of the file.
std::optional<Sourced> count_at(const CaptureFacts& facts, const std::string& path);

/// The data that every section may use.
struct Context {
  const StoredScene& scene;
  const ReportOptions& options;
  CaptureFacts facts;
  std::optional<TransportErrors> errors;  ///< present when truth is known
  std::vector<HeldOutError> held_out;     ///< one for each held-out photograph
  std::vector<Stage> stages;              ///< of the capture
  std::string stem;                       ///< the beginning of the names of saved files

  const TransportTensor& tensor() const { return scene.tensor; }
  bool has_truth() const { return static_cast<bool>(options.truth); }
  bool has_own_pixels() const { return options.own_pixels.has_value(); }
  /// The picture of a light, on the finest pixels that the scene has; and what it should be, if that is
  /// known.
  Result<Image<float>> picture(const Image<float>& light) const {
    return has_own_pixels() ? options.own_pixels->relit(light) : tensor().apply(light);
  }
  const TrueTransport& true_picture() const {
    return has_own_pixels() ? options.own_pixels->truth : options.truth;
  }
  /// The name of a saved file: "scene-flood-lit".
  std::string file(std::string_view what) const { return stem + "-" + std::string(what); }
};

/// A section of the page; empty html if this scene has nothing to show there.
struct Section {
  std::string id, name, html;
};

std::string headline(const Context& context);                // title and grids
Result<std::string> scene_pictures(const Context& context);  // flood-lit and relit, at the top
std::string key_numbers(const Context& context);             // tiles
Result<std::string> lights_section(const Context& context);  // flood-lit, bar, letters, beside truth
Result<std::string> inside_section(const Context& context);  // a slice of T, the level map
Result<std::string> levels_section(const Context& context);  // Fig. 9 and Fig. 11, maps, ranks
std::string errors_section(const Context& context);  // the errors of TransportErrors, and how they fell
Result<std::string> held_out_section(const Context& context);  // photographs beside predictions
std::string cost_section(const Context& context);              // patterns, time, memory
std::string made_section(const Context& context);              // command, version and date

/// Parts of sections.
std::string error_curves(const Context& context);               // error over patterns and over seconds
Result<std::string> pictures_by_level(const Context& context);  // as if stopped after each level
Result<std::string> maps_over_the_picture(const Context& context);
std::string ranks_of_leaves(const TransportTensor& tensor);

/// A number of the file, with its source.
std::string sourced_text(const std::optional<Sourced>& sourced, std::string (*text)(double));
/// All digits, for the tables that scripts read; "" without a number.
std::string exact_or_empty(const std::optional<Sourced>& number);

/// ‖estimate − truth‖ / ‖truth‖ over all values; 0 if truth is all zero.
double relative_error(const Image<float>& estimate, const Image<float>& truth);

/// Pictures of larger grids are reduced by averaging to this many pixels on the longer side, to keep the page
/// small.
inline constexpr int kPictureSide = 640;
/// The same for pictures with four in a row.
inline constexpr int kSmallSide = 400;

}  // namespace symrig::report
