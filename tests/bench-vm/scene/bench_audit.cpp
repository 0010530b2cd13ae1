// SPDX-License-Identifier: Apache-2.0
// Finds, from outside the product, the frames of each photograph of a capture on the bench.
#include "bench-vm/scene/audit.hpp"
#include "symrig/sim/scene.hpp"

#include <cstdio>
#include <exception>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace symrig::bench_vm {
namespace {

struct Options {
  std::string log, truth, scene;
  AuditOptions audit;
};

void add_options(CLI::App& app, Options& options) {
  app.add_option("log", options.log, "photograph log from symrig capture --keep-log")->required();
  app.add_option("truth", options.truth, "log from bench_scene --log of the same capture")->required();
  app.add_option("scene", options.scene, "bench_scene's scene")->required();
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

Result<bool> run(const Options& options) {
  SYMRIG_TRY(const SceneUri uri, parse_scene_uri(options.scene));
  SYMRIG_TRY(const auto bench, sim::make_bench(uri));
  const sim::ImageFormation formation(uri, *bench.view);
  SYMRIG_TRY(const auto truth, read_true_exposures(options.truth));
  SYMRIG_TRY(const auto log, read_photograph_log(options.log));
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
    const auto right = symrig::bench_vm::run(options);
    if (right) return *right ? 0 : 1;
    fmt::print(stderr, "bench_audit: {}\n", right.error().line());
    return symrig::exit_code(right.error().code);
  } catch (const std::exception& error) {  // memory
    static_cast<void>(std::fputs(error.what(), stderr));
    return symrig::exit_code(symrig::ErrorCode::limit);
  }
}
