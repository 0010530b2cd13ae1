// SPDX-License-Identifier: Apache-2.0
#include "symrig/report/html_report.hpp"

#include "report/html.hpp"
#include "report/sections.hpp"

#include <filesystem>
#include <utility>

namespace symrig {
namespace {

/// Reports the progress of the page.
/// fails: interrupted.
class Steps {
 public:
  explicit Steps(const Progress& progress) : progress_(progress) {}
  Result<void> begin(std::string_view stage) {
    if (progress_ && !progress_({stage, done_++, 6}))
      return Error{ErrorCode::interrupted, "stopped while writing the report", "nothing was written"};
    return {};
  }

 private:
  const Progress& progress_;
  std::int64_t done_ = 0;
};

Result<std::optional<TransportErrors>> errors_of(const StoredScene& scene, const ReportOptions& options) {
  if (!options.truth) return std::optional<TransportErrors>();
  SYMRIG_TRY(const TransportErrors errors, evaluate(scene.tensor, options.truth));
  return std::optional<TransportErrors>(errors);
}

Result<std::vector<HeldOutError>> held_out_errors(const StoredScene& scene) {
  std::vector<HeldOutError> errors;
  for (const HeldOut& one : scene.held_out) {
    SYMRIG_TRY(HeldOutError error, held_out_error(scene.tensor, one));
    errors.push_back(std::move(error));
  }
  return errors;
}

/// The non-empty sections, in the order of the page.
Result<std::vector<report::Section>> sections(const report::Context& context, Steps& steps) {
  std::vector<report::Section> all{{"errors", "Errors", report::errors_section(context)}};
  SYMRIG_CHECK(steps.begin("new light"));
  SYMRIG_TRY(std::string lights, report::lights_section(context));
  all.push_back({"lights", "New light", std::move(lights)});
  SYMRIG_CHECK(steps.begin("levels"));
  SYMRIG_TRY(std::string levels, report::levels_section(context));
  all.push_back({"levels", "Levels", std::move(levels)});
  SYMRIG_CHECK(steps.begin("slice of T"));
  SYMRIG_TRY(std::string inside, report::inside_section(context));
  all.push_back({"inside", "Inside", std::move(inside)});
  SYMRIG_CHECK(steps.begin("held-out photographs"));
  SYMRIG_TRY(std::string held_out, report::held_out_section(context));
  all.push_back({"held-out", "Held-out photographs", std::move(held_out)});
  SYMRIG_CHECK(steps.begin("page"));
  all.push_back({"cost", "Cost", report::cost_section(context)});
  all.push_back({"made", "How it was made", report::made_section(context)});
  std::erase_if(all, [](const report::Section& one) { return one.html.empty(); });
  return all;
}

std::string footer() {
  return "<footer>Made by <code>symrig report</code>. Method: G. Garg, E.-V. Talvala, M. Levoy, H. P. A. "
         "Lensch, Symmetric "
         "Photography: Exploiting Data-sparseness in Reflectance Fields, EGSR 2006.</footer>\n";
}

}  // namespace

Result<std::string> html_report(const StoredScene& scene, const ReportOptions& options) {
  Steps steps(options.progress);
  SYMRIG_CHECK(steps.begin("errors"));
  SYMRIG_TRY(std::optional<TransportErrors> errors, errors_of(scene, options));
  SYMRIG_TRY(std::vector<HeldOutError> held_out, held_out_errors(scene));
  report::CaptureFacts facts(scene.capture_json);
  std::vector<report::Stage> stages = report::stages_of(facts);
  const report::Context context{scene,
                                options,
                                std::move(facts),
                                errors,
                                std::move(held_out),
                                std::move(stages),
                                report::file_stem(std::filesystem::path(options.title).stem().string())};
  SYMRIG_TRY(const std::string pictures, report::scene_pictures(context));
  SYMRIG_TRY(const std::vector<report::Section> all, sections(context, steps));
  std::vector<std::pair<std::string, std::string>> links;
  std::string html;
  for (const report::Section& one : all) {
    links.emplace_back(one.id, one.name);
    html += one.html;
  }
  return report::page(options.title, report::headline(context) + report::navigation(links) + pictures +
                                         report::key_numbers(context) + html + footer());
}

}  // namespace symrig
