// SPDX-License-Identifier: Apache-2.0
#include "polish.hpp"

#include "capture_text.hpp"
#include "commands.hpp"
#include "meter.hpp"
#include "options.hpp"
#include "output.hpp"
#include "ranks.hpp"
#include "symrig/base/time.hpp"

#include <memory>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace symrig::mpi {
namespace {

struct PolishArguments {
  PolishJob job;
  std::string output, json;
};

std::string to_json(const PolishArguments& arguments, const Polished& polished, double seconds) {
  using Json = nlohmann::ordered_json;
  const Json facts = Json::parse(polished.scene.capture_json);
  Json json{
      {"command", "polish"},         {"scene", arguments.job.scene},    {"log", arguments.job.log},
      {"output", arguments.output},  {"ranks", Ranks::world().count()}, {"photographs", polished.photographs},
      {"polish", facts.at("polish")}};
  for (const char* key : {"estimated_error", "estimated_error_uncertainty", "estimated_error_not_given"})
    json[key] = facts.at(key);
  json["seconds"] = seconds;
  return apps::json_text(json, 1);
}

std::string result_text(const PolishArguments& arguments, const Polished& polished, double seconds) {
  return fmt::format("{}: refitted to {} photographs in {} step{}, {}\n", arguments.output,
                     apps::grouped(static_cast<double>(polished.photographs)), polished.steps,
                     polished.steps == 1 ? "" : "s", apps::duration(seconds)) +
         fmt::format("weighted misfit {:.6g}, before {:.6g}\n", polished.after, polished.before) +
         "relative errors, estimated from held-out photographs\n" + apps::error_table(polished.errors);
}

Result<Polished> polish_with_meter(const PolishJob& job) {
  apps::Meter meter("polish", "exchanges");
  return polish(Ranks::world(), job, meter.progress());
}

Result<void> run(PolishArguments arguments) {
  PolishJob& job = arguments.job;
  if (job.log.empty()) job.log = job.scene + ".log";
  SYMRIG_CHECK(JobFiles()
                   .reads("the scene", job.scene)
                   .reads("the log", job.log)
                   .writes("-o", arguments.output, FileFormat::scene)
                   .writes("--json", arguments.json, FileFormat::json)
                   .check());
  const Stopwatch watch;
  SYMRIG_TRY(const Polished polished, polish_with_meter(job));
  SYMRIG_CHECK(save_scene(arguments.output, polished.scene));
  const double seconds = watch.seconds();
  SYMRIG_CHECK(apps::write_text(arguments.json, to_json(arguments, polished, seconds)));
  if (is_standard_output(arguments.json)) return {};
  return apps::print(result_text(arguments, polished, seconds));
}

}  // namespace

apps::Job add_polish(CLI::App& command) {
  const auto arguments = std::make_shared<PolishArguments>();
  command.add_option("scene", arguments->job.scene, "Tensor file of a capture that has kept its log")
      ->required()
      ->type_name("scene.h5");
  command.add_option("-o,--output", arguments->output, "Tensor file to write (HDF5)")
      ->required()
      ->type_name("polished.h5");
  command
      .add_option("--log", arguments->job.log,
                  "Photographs of the capture (default: the scene's name + .log)")
      ->type_name("scene.h5.log");
  command.add_option("--steps", arguments->job.steps, "Gauss-Newton steps at most, 1 to 20 (default: 2)")
      ->type_name("N");
  command
      .add_option("--parts", arguments->job.parts,
                  "Parts of T; equal parts give equal bits, whatever the ranks (default: one a rank)")
      ->type_name("N");
  apps::add_json(command, arguments->json);
  for (const char* option : {"--steps", "--parts"}) apps::takes_number<int>(command.get_option(option));
  command.footer(
      std::string(
          "Example:\n"
          "  symrig capture --rig RIG --polish 0 --keep-log -o scene.h5\n"
          "  mpirun -n 2 symrig-mpi polish scene.h5 -o polished.h5\n"
          "\n"
          "Refits all leaves and entries of T to all photographs in the log, except the held-out ones, "
          "as a capture\n"
          "does at its end. It stops earlier when a step gains nothing. Then it estimates the errors "
          "anew, from the\n"
          "held-out photographs.\n"
          "Each process holds its share of T and reads the whole log. Results of different numbers of parts "
          "differ by rounding\n"
          "only. With the same --parts, any number of processes up to it writes the same numbers, bit for "
          "bit; more parts\n"
          "take more time.\n"
          "\n") +
      apps::kExitCodes);
  return [arguments] { return run(*arguments); };
}

}  // namespace symrig::mpi
