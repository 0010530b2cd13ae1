// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"
#include "meter.hpp"
#include "options.hpp"
#include "output.hpp"
#include "program.hpp"
#include "rig.hpp"
#include "symrig/job/evaluation.hpp"
#include "symrig/report/html_report.hpp"
#include "symrig/report/summary.hpp"
#include "symrig/tensor/file.hpp"

#include <filesystem>
#include <memory>

#include <fmt/format.h>

namespace symrig::apps {
namespace {

struct ReportArguments {
  std::string scene, output, memory;
};

Result<void> run(const ReportArguments& arguments) {
  SYMRIG_CHECK(JobFiles()
                   .reads("the scene", arguments.scene)
                   .writes("-o", arguments.output, FileFormat::page)
                   .check());
  SYMRIG_TRY(const std::int64_t memory, memory_of(arguments.memory));
  SYMRIG_TRY(const StoredScene scene, load_scene(arguments.scene, {.memory = memory}));
  Meter meter("report", "sections");
  ReportOptions options{.title = std::filesystem::path(arguments.scene).filename().string(),
                        .progress = meter.progress(),
                        .made = made_now()};
  SYMRIG_CHECK(add_truths(scene, options));
  SYMRIG_TRY(const std::string page, html_report(scene, options));
  SYMRIG_CHECK(write_text(arguments.output, page));
  if (is_standard_output(arguments.output)) return {};
  return print(fmt::format("{}: {}, open it in a browser\n", arguments.output,
                           byte_size(static_cast<double>(page.size()))));
}

}  // namespace

Job add_report(CLI::App& command) {
  const auto arguments = std::make_shared<ReportArguments>();
  command.add_option("scene", arguments->scene, "Tensor file of capture or fit")
      ->required()
      ->type_name("scene.h5");
  add_memory(command, arguments->memory);
  command.add_option("-o,--output", arguments->output, "HTML page to write")
      ->required()
      ->type_name("report.html");
  command.footer(
      std::string(
          "Example:\n"
          "  symrig report scene.h5 -o report.html\n"
          "\n"
          "The page shows pictures under new light, a slice of T, the leaves of each level, errors, and "
          "the cost. Beside\n"
          "the pictures it shows the truth (of a simulated scene) or held-out photographs (of a fitted "
          "scene). Pictures are on the camera's own pixels if the scene has them, with the chi-square of "
          "each pixel. It is one\n"
          "HTML file that loads nothing else and runs no script.\n"
          "\n") +
      kExitCodes);
  return [arguments] { return run(*arguments); };
}

}  // namespace symrig::apps
