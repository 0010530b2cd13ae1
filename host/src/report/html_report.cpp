// SPDX-License-Identifier: Apache-2.0
#include "symrig/report/html_report.hpp"

#include "report/html.hpp"
#include "report/sections.hpp"

namespace symrig {
namespace {

/// Tells how far the page is. fails: interrupted.
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
  SYMRIG_TRY(const std::vector<HeldOutError> held_out_of, held_out_errors(scene));
  const report::Context context{scene, options, report::CaptureFacts(scene.capture_json), errors,
                                held_out_of};
  std::string body = report::headline(context);
  SYMRIG_CHECK(steps.begin("new light"));
  SYMRIG_TRY(const std::string lights, report::lights_section(context));
  SYMRIG_CHECK(steps.begin("held-out photographs"));
  SYMRIG_TRY(const std::string held_out, report::held_out_section(context));
  SYMRIG_CHECK(steps.begin("slice of T"));
  SYMRIG_TRY(const std::string inside, report::inside_section(context));
  SYMRIG_CHECK(steps.begin("levels"));
  SYMRIG_TRY(const std::string levels, report::levels_section(context));
  SYMRIG_CHECK(steps.begin("page"));
  body += held_out + lights + report::errors_section(context) + inside + levels +
          report::cost_section(context) + footer();
  return report::page(options.title, body);
}

}  // namespace symrig
