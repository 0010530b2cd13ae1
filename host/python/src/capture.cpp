// SPDX-License-Identifier: Apache-2.0
#include "bindings.hpp"
#include "caller.hpp"
#include "rig.hpp"
#include "symrig/job/capture_job.hpp"
#include "symrig/job/capture_page.hpp"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <pybind11/stl.h>

namespace symrig::python {
namespace {

template <class T>
std::optional<T> given(const py::dict& options, const char* name) {
  const py::object value = options[name];
  if (value.is_none()) return std::nullopt;
  try {
    return value.cast<T>();
  } catch (const py::cast_error&) {
    throw Failure{{ErrorCode::bad_argument, std::string(name) + " is " + py::repr(value).cast<std::string>(),
                   "give a number"}};
  }
}

bool flag(const py::dict& options, const char* name) {
  return py::bool_(options[name]);
}

CaptureOptions options_of(const py::dict& options) {
  const GivenBudgets budgets{given<std::int64_t>(options, "max_patterns"),
                             given<double>(options, "max_seconds"), given<double>(options, "target_error")};
  check(check_budgets(budgets));
  std::optional<SplitOrder> split;
  if (const auto order = given<std::string>(options, "split")) split = value_of(parse_split_order(*order));
  return {.algorithm = value_of(parse_algorithm(options["algorithm"].cast<std::string>())),
          .tolerance = given<double>(options, "tolerance"),
          .polish = given<int>(options, "polish"),
          .photograph_seconds = given<double>(options, "photograph_seconds"),
          .split = split,
          .dual_threshold = given<double>(options, "dual_threshold"),
          .dual_subtracts = flag(options, "dual_subtracts"),
          .max_patterns = budgets.max_patterns.value_or(0),
          .max_seconds = budgets.max_seconds.value_or(0),
          .target_error = budgets.target_error.value_or(0),
          .unchecked = flag(options, "unchecked")};
}

Made made_in_python() {
  return {utc_now(), SYMRIG_VERSION, "symrig.capture() of Python"};
}

CaptureJob job_of(const std::string& output, const py::dict& options) {
  return {.output = output,
          .log = {.resume = flag(options, "resume"),
                  .keep = flag(options, "keep_log"),
                  .off = !flag(options, "log")},
          .memory = given<std::int64_t>(options, "memory").value_or(0),
          .options = options_of(options),
          .cells_only = flag(options, "cells"),
          .fit_seconds = given<double>(options, "fit_seconds"),
          .check_axis = flag(options, "check_axis"),
          .made = made_in_python};
}

using SharedPage = std::shared_ptr<CapturePage>;

/// watch: None or False: no page; True: a page at any free port; a number: at this port.
SharedPage page_of(const py::dict& options, const OpenedRig& rig, const std::string& output) {
  const py::object watch = options["watch"];
  if (watch.is_none() || watch.is(py::bool_(false))) return nullptr;
  ViewOptions view;
  view.title = output.empty() ? "symrig.capture()" : std::filesystem::path(output).filename().string();
  if (!watch.is(py::bool_(true))) {
    const auto port = given<long long>(options, "watch");
    if (!port || *port < 1 || *port > 65535)
      throw Failure{{ErrorCode::bad_argument, "watch is " + py::repr(watch).cast<std::string>(),
                     "give True, or a port from 1 to 65535"}};
    view.port = static_cast<std::uint16_t>(*port);
  }
  auto page = std::make_shared<CapturePage>(value_of(CapturePage::open(rig, std::move(view))));
  py::module_::import("symrig._capture").attr("_tell_address")(page->address());
  return page;
}

/// The exception that Python raises for it says the same.
Result<CaptureOutcome> run_on_page(const CaptureJob& job, RigInUse& rig, const CapturePage* page) {
  if (page == nullptr) return run_job(job, rig.opened);
  auto outcome = run_job(page->watched(job, rig.opened), rig.opened);
  if (outcome)
    page->complete(*outcome);
  else
    page->fail(rig.caller->reason(outcome.error()));
  return outcome;
}

/// The scene, and its page or None. The page serves as long as somebody holds it.
py::tuple run(CaptureJob job, const py::dict& options, RigInUse& rig, py::object progress) {
  const Turn turn(rig, std::move(progress));
  job.options.progress = rig.caller->progress();
  const SharedPage page = page_of(options, rig.opened, job.output);
  CaptureOutcome outcome = rig.caller->run([&] { return run_on_page(job, rig, page.get()); });
  for (const std::string& text : capture_warnings(outcome.summary, outcome.result)) warn(text);
  const auto scene = std::make_shared<StoredScene>(std::move(outcome).scene());
  return py::make_tuple(scene, page);
}

/// Files are checked before the rig is opened.
void check_files(const CaptureJob& job, const std::string& rig, const std::string& registration) {
  JobFiles files = rig.empty() ? JobFiles() : rig_files(rig);
  files.reads("the registration", registration).writes("output", job.output, FileFormat::scene);
  check(CaptureLog::declare(job.output, job.log, std::move(files)).check());
  value_of(check_job(job));
}

py::tuple capture_by_name(const std::string& name, const std::string& registration, const std::string& output,
                          const py::dict& options, py::object progress) {
  CaptureJob job = job_of(output, options);
  check_files(job, name, registration);
  const double most =
      job.options.max_seconds > 0 ? job.options.max_seconds : std::numeric_limits<double>::infinity();
  const std::unique_ptr<RigInUse> rig = open_rig_by_name(name, registration, most);
  return run(std::move(job), options, *rig, std::move(progress));
}

py::tuple capture_rig(RigInUse& rig, const std::string& output, const py::dict& options,
                      py::object progress) {
  CaptureJob job = job_of(output, options);
  check_files(job, "", "");
  return run(std::move(job), options, rig, std::move(progress));
}

}  // namespace

void bind_capture(py::module_& module) {
  py::class_<CapturePage, SharedPage>(module, "CapturePage")
      .def_property_readonly("address", &CapturePage::address);
  module.def("capture_by_name", capture_by_name);
  module.def("capture_rig", capture_rig);
}

}  // namespace symrig::python
