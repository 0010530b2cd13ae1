// SPDX-License-Identifier: Apache-2.0

#include "capi/guard.hpp"
#include "capi/handles.hpp"
#include "symrig/base/files.hpp"
#include "symrig/board/board_info.hpp"
#include "symrig/board/link.hpp"
#include "symrig/program/compile.hpp"
#include "symrig/run/run.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <memory>
#include <string>

#include <nlohmann/json.hpp>

namespace {

using symrig::Error;
using symrig::ErrorCode;
using symrig::Result;
using namespace symrig;
using namespace symrig::capi;

Result<Board> connect(const std::string& uri, const symrig_program* program) {
  BoardOptions options;
  if (program != nullptr) options.keep_alive = program->keep_alive();
  if (uri == "sim:" && program != nullptr) return Board::connect(make_sim_rig(program->wiring()), options);
  SYMRIG_TRY(const auto parsed, DeviceUri::parse(uri));
  SYMRIG_TRY(auto link, open_link(parsed));
  return Board::connect(std::move(link), options);
}

Result<CompiledProgram> compile_for(const symrig_program& program, const BoardInfo& board) {
  if (program.compiled) return *program.compiled;
  auto compilation = compile_program(*program.file, board);
  if (compilation.ok()) return *std::move(compilation.program);
  for (const FileFinding& finding : compilation.findings)
    if (finding.severity == Severity::error)
      return Error{ErrorCode::bad_value, finding.text(program.file->path), "lint the program"};
  return Error{ErrorCode::bad_value, "the program does not compile", "lint the program"};
}

symrig_progress to_c(const RunProgress& at) {
  return {at.patterns, at.patterns_asked, at.marks, symrig::seconds(at.elapsed),
          symrig::seconds(at.expected)};
}

Result<RunRecord> run(symrig_board& board, const symrig_program& program, symrig_on_progress on_progress,
                      void* user) {
  SYMRIG_TRY(const auto compiled, compile_for(program, board.board.info()));
  RunOptions options;
  options.progress = [&board, on_progress, user](const RunProgress& at) {
    if (board.stop) return false;
    if (on_progress == nullptr) return true;
    const symrig_progress progress = to_c(at);
    return on_progress(&progress, user) == 0;
  };
  return run_program(board.board, compiled, options);
}

}  // namespace

int symrig_board_open(const char* uri, const symrig_program* program, symrig_board** board,
                      symrig_error* error) {
  return guarded(error, [&] {
    if (uri == nullptr) return missing("uri", error);
    if (board == nullptr) return missing("board", error);
    *board = nullptr;
    auto connected = connect(uri, program);
    if (!connected) return report(connected.error(), error);
    *board = std::make_unique<symrig_board>(std::move(connected).value()).release();
    return 0;
  });
}

void symrig_board_close(symrig_board* board) {
  if (board == nullptr) return;
  const std::unique_ptr<symrig_board> owned(board);
  guarded(nullptr, [&] {
    const std::scoped_lock lock(owned->mutex);
    const auto status = owned->board.status();
    const bool going = status && (status->state == BoardState::armed || status->state == BoardState::running);
    if (going && !owned->board.abort()) return 1;
    return 0;
  });
}

int symrig_board_info(const symrig_board* board, char** json, symrig_error* error) {
  return guarded(error, [&] {
    if (board == nullptr) return missing("board", error);
    if (json == nullptr) return missing("json", error);
    *json = nullptr;
    return give_text(board_file_text(board->board.info()), json, error);
  });
}

int symrig_board_abort(symrig_board* board, symrig_error* error) {
  return guarded(error, [&] {
    if (board == nullptr) return missing("board", error);
    board->stop = true;
    const std::unique_lock lock(board->mutex, std::try_to_lock);
    if (!lock.owns_lock()) return 0;  // the run in the other thread sees `stop` and aborts
    board->stop = false;
    const auto done = board->board.abort();
    return done ? 0 : report(done.error(), error);
  });
}

int symrig_board_clear_fault(symrig_board* board, symrig_error* error) {
  return guarded(error, [&] {
    if (board == nullptr) return missing("board", error);
    const std::scoped_lock lock(board->mutex);
    const auto done = board->board.clear_fault();
    return done ? 0 : report(done.error(), error);
  });
}

int symrig_board_run(symrig_board* board, const symrig_program* program, symrig_on_progress on_progress,
                     void* user, char** receipt, symrig_error* error) {
  return guarded(error, [&] {
    if (receipt != nullptr) *receipt = nullptr;
    if (board == nullptr) return missing("board", error);
    if (program == nullptr) return missing("program", error);
    const std::scoped_lock lock(board->mutex);
    board->stop = false;  // set by an earlier call
    const auto record = run(*board, *program, on_progress, user);
    board->stop = false;
    if (!record) return report(record.error(), error);
    if (receipt != nullptr)
      if (const int code = give_text(receipt_json(*record), receipt, error); code != 0) return code;
    const auto failure = run_error(*record);
    return failure ? report(*failure, error) : 0;
  });
}

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
