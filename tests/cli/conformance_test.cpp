// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"

namespace symrig::conformance_test {
namespace {

class ConformanceCommand : public test::CommandTest {};

TEST_F(ConformanceCommand, simulated_board_passes) {
  const test::Outcome outcome = symrig({"conformance", "sim:", "--json", "checks.json"});
  EXPECT_EQ(outcome.code, 0) << outcome.out << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_NE(outcome.out.find("pass  wire.corrupted\n"), std::string::npos);
  EXPECT_NE(outcome.out.find("skip  jumper.stamps: needs a jumper from an output to an input\n"),
            std::string::npos);
  const nlohmann::json told = json("checks.json");
  EXPECT_EQ(told["failed"], 0);
  EXPECT_EQ(told["passed"].get<int>() + told["skipped"].get<int>(), static_cast<int>(told["checks"].size()));
  EXPECT_GT(told["passed"].get<int>(), 90);
}

TEST_F(ConformanceCommand, filter) {
  const test::Outcome outcome = symrig({"conformance", "sim:", "--filter", "^clock"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.out.find("wire."), std::string::npos);
  EXPECT_NE(outcome.out.find("4 passed, 0 failed, 0 skipped"), std::string::npos) << outcome.out;
}

TEST_F(ConformanceCommand, nothing_to_check_is_no_success) {
  const test::Outcome outcome = symrig({"conformance", "sim:", "--filter", "^jumper"});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_NE(outcome.err.find("all checks were skipped"), std::string::npos) << outcome.err;
}

TEST_F(ConformanceCommand, wrong_options) {
  expect_refusal({"conformance", "sim:", "--filter", "("}, 2, {"regular expression"});
  expect_refusal({"conformance", "sim:", "--filter", "nonsense"}, 2, {"nonsense", "docs/conformance.md"});
  expect_refusal({"conformance", "sim:", "--jumper", "lamp"}, 2, {"OUTPUT:INPUT"});
  expect_refusal({"conformance", "sim:", "--jumper", "lamp:vsync"}, 2, {"lamp", "projector_trigger"});
  expect_refusal({"conformance", "nowhere:"}, 2, {"nowhere"});
  setenv("SYMRIG_DEVICE", "nonsense:", 1);
  expect_refusal({"conformance"}, 2, {"nonsense"});
  unsetenv("SYMRIG_DEVICE");
}

}  // namespace
}  // namespace symrig::conformance_test
