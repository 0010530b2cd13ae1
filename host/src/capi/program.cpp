// SPDX-License-Identifier: Apache-2.0
#include "capi/guard.hpp"
#include "capi/handles.hpp"
#include "symrig/base/files.hpp"
#include "symrig/program/symprog.hpp"

#include <memory>

#include <nlohmann/json.hpp>

namespace {

using symrig::Error;
using symrig::Result;
using namespace symrig;
using namespace symrig::capi;

Result<symrig_program> load(const std::string& path) {
  SYMRIG_TRY(const auto bytes, symrig::read_file(path, 256U << 20U));
  const std::span records(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  symrig_program program;
  if (looks_like_symprog(records)) {
    auto compiled = read_symprog(records);
    if (!compiled)
      return Error{compiled.error().code, path + ": " + compiled.error().what, compiled.error().hint};
    program.compiled = *std::move(compiled);
  } else {
    SYMRIG_TRY(program.file, read_program_file(path));
  }
  return program;
}

std::string findings_json(const Compilation& compilation) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const FileFinding& finding : compilation.findings)
    list.push_back({{"line", finding.place},
                    {"severity", name(finding.severity)},
                    {"rule", finding.rule},
                    {"what", finding.what},
                    {"alternative", finding.alternative}});
  return nlohmann::ordered_json{{"ok", compilation.ok()}, {"findings", std::move(list)}}.dump();
}

}  // namespace

int symrig_program_load(const char* path, symrig_program** program, symrig_error* error) {
  return guarded(error, [&] {
    if (path == nullptr) return missing("path", error);
    if (program == nullptr) return missing("program", error);
    *program = nullptr;
    auto loaded = load(path);
    if (!loaded) return report(loaded.error(), error);
    *program = std::make_unique<symrig_program>(*std::move(loaded)).release();
    return 0;
  });
}

void symrig_program_free(symrig_program* program) {
  delete program;
}

int symrig_program_lint(const symrig_program* program, const symrig_board* board, char** json,
                        symrig_error* error) {
  return guarded(error, [&] {
    if (program == nullptr) return missing("program", error);
    if (board == nullptr) return missing("board", error);
    if (json == nullptr) return missing("json", error);
    *json = nullptr;
    const BoardInfo& info = board->board.info();
    if (program->file) return give_text(findings_json(compile_program(*program->file, info)), json, error);
    if (const auto fits = check_board_fits(*program->compiled, info); !fits)
      return report(fits.error(), error);
    return give_text(R"({"ok":true,"findings":[]})", json, error);
  });
}
