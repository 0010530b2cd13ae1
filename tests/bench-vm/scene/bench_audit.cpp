// SPDX-License-Identifier: Apache-2.0
// Finds, from outside the product, the frames of each photograph of a capture on the bench.
#include "bench-vm/scene/audit.hpp"
#include "symrig/calibration/registration.hpp"
#include "symrig/sim/scene.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace symrig::bench_vm {
namespace {

constexpr std::size_t kTextSizeAt = 16;  // docs/photograph-log.md
constexpr std::size_t kTextAt = 24;
constexpr std::uint64_t kLongestText = 1 << 20;

Error not_a_log(const std::string& path) {
  return {ErrorCode::bad_format, path + " is not a photograph log", "symrig capture --keep-log writes one"};
}

/// Removes the line "key value" from the front of the text, and returns the value.
std::string take_line(std::istringstream& text, const std::string& key) {
  std::string line;
  std::getline(text, line);
  return line.starts_with(key + " ") ? line.substr(key.size() + 1) : std::string();
}

/// Opens the log of any capture.
/// fails: as open_photograph_log, bad_format.
Result<std::unique_ptr<PhotographLog>> open_any_log(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::array<char, kTextAt> front{};
  if (!file.read(front.data(), front.size())) return not_a_log(path);
  std::uint64_t bytes = 0;
  std::memcpy(&bytes, front.data() + kTextSizeAt, sizeof bytes);
  if (bytes > kLongestText) return not_a_log(path);
  std::string head(bytes, '\0');
  if (!file.read(head.data(), static_cast<std::streamsize>(bytes))) return not_a_log(path);
  std::istringstream text(head);
  LogIdentity identity;
  const auto scene = parse_scene_uri("sim:plane?size=" + take_line(text, "grid"));  // reads the numbers
  if (!scene) return not_a_log(path);
  identity.grid = scene->size;
  identity.channels = take_line(text, "channels") == "3" ? 3 : 1;
  identity.rig = take_line(text, "rig");
  const std::size_t options = text.tellg();
  identity.options = head.substr(std::min(options, head.size()));
  return open_photograph_log(path, identity);
}

struct Options {
  std::string log, truth, scene, registration;
  AuditOptions audit;
};

void add_options(CLI::App& app, Options& options) {
  app.add_option("log", options.log, "photograph log from symrig capture --keep-log")->required();
  app.add_option("truth", options.truth, "log from bench_scene --log of the same capture")->required();
  app.add_option("scene", options.scene, "bench_scene's scene")->required();
  app.add_option("--registration", options.registration, "registration.h5 of the capture, if it has one");
  app.add_option("--first-frame", options.audit.first_frame, "bench_scene's");
  app.add_option("--exposures", options.audit.exposures, "frames per photograph")->capture_default_str();
  app.add_flag("--scattered", options.audit.scattered,
               "frames of a photograph need not follow each other (bit planes)");
  app.add_option("--limit", options.audit.limit, "distance of a wrong photograph, sigmas")
      ->capture_default_str();
}

void print(const Audit& audit) {
  fmt::print(
      "{} photographs: {} wrong, {} with a pattern that no exposure had; the others at most {:.3f} sigma "
      "from "
      "their true frames\n{} wrong frames planted: {} found, {} without effect, {} overlooked\n",
      audit.photographs.size(), audit.wrong, audit.unseen, audit.farthest_right, audit.planted, audit.found,
      audit.harmless, audit.planted - audit.found - audit.harmless);
  for (std::size_t k = 0; k < audit.photographs.size(); ++k)
    if (audit.photographs[k].distance < 0)
      fmt::print("photograph {}: no bracket was exposed with its pattern\n", k);
    else if (audit.photographs[k].distance > 0 && audit.wrong > 0)
      fmt::print("photograph {}: {:.3f} sigma from the bracket that began with frame {}\n", k,
                 audit.photographs[k].distance, audit.photographs[k].first_frame);
}

/// None without a registration.
Result<std::optional<CellWeights>> weights_of(const std::string& registration) {
  if (registration.empty()) return std::optional<CellWeights>();
  SYMRIG_TRY(const Registration found, load_registration(registration));
  SYMRIG_TRY(CellWeights weights, found.weights());
  return std::optional<CellWeights>(std::move(weights));
}

Result<bool> run(Options options) {
  SYMRIG_TRY(const SceneUri uri, parse_scene_uri(options.scene));
  SYMRIG_TRY(const auto bench, sim::make_bench(uri));
  const sim::ImageFormation formation(uri, *bench.view);
  SYMRIG_TRY(const auto truth, read_true_exposures(options.truth));
  SYMRIG_TRY(const auto log, open_any_log(options.log));
  SYMRIG_TRY(const auto weights, weights_of(options.registration));
  options.audit.weights = weights ? &*weights : nullptr;
  SYMRIG_TRY(const Audit audited, audit(*log, truth, formation, options.audit));
  print(audited);
  return audited.wrong == 0 && audited.unseen == 0 && !audited.photographs.empty();
}

}  // namespace
}  // namespace symrig::bench_vm

int main(int argc, char** argv) {
  try {
    CLI::App app("Finds the frames of each photograph. Exit code 1: a photograph has a wrong frame.");
    symrig::bench_vm::Options options;
    symrig::bench_vm::add_options(app, options);
    try {
      app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
      return app.exit(error) == 0 ? 0 : symrig::exit_code(symrig::ErrorCode::bad_argument);
    }
    const auto right = symrig::bench_vm::run(std::move(options));
    if (right) return *right ? 0 : 1;
    fmt::print(stderr, "bench_audit: {}\n", right.error().line());
    return symrig::exit_code(right.error().code);
  } catch (const std::exception& error) {  // memory
    static_cast<void>(std::fputs(error.what(), stderr));
    return symrig::exit_code(symrig::ErrorCode::limit);
  }
}
