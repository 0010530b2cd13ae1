// SPDX-License-Identifier: Apache-2.0
#include "acquisition/log/photograph_record.hpp"
#include "symrig/acquisition/photograph_log.hpp"

#include <utility>

namespace symrig {
namespace {

using acquisition::PhotographShape;
using acquisition::Record;

class MemoryLog final : public PhotographLog {
 public:
  explicit MemoryLog(PhotographShape shape) : shape_(shape) {}

  Grid grid() const override { return shape_.grid; }
  int channels() const override { return shape_.channels; }
  std::int64_t size() const override { return std::ssize(records_); }

  Result<void> append_run(std::span<const Pattern> patterns, std::span<const Radiance> photographs,
                          const ProbeCost& spent) override {
    SYMRIG_CHECK(acquisition::check_run(shape_, patterns, photographs));
    for (std::size_t k = 0; k < patterns.size(); ++k)
      acquisition::encode_record(patterns[k], photographs[k],
                                 {spent, static_cast<std::uint32_t>(patterns.size() - k - 1), false},
                                 records_.emplace_back());
    return {};
  }

  Result<Pattern> pattern(std::int64_t k) const override {
    SYMRIG_TRY(const Record* record, at(k));
    return acquisition::record_pattern(shape_, *record);
  }
  Result<Radiance> photograph(std::int64_t k) const override {
    SYMRIG_TRY(const Record* record, at(k));
    return acquisition::record_photograph(shape_, *record);
  }
  Result<void> read(std::int64_t k, LoggedPhotograph& to) const override {
    SYMRIG_TRY(const Record* record, at(k));
    acquisition::read_record(shape_, *record, to);
    return {};
  }
  Result<ProbeCost> spent(std::int64_t k) const override {
    SYMRIG_TRY(const Record* record, at(k));
    return acquisition::record_spent(*record);
  }

 private:
  Result<const Record*> at(std::int64_t k) const {
    if (k < 0 || k >= size()) return acquisition::no_such_photograph(k, size());
    return &records_[k];
  }

  PhotographShape shape_;
  std::vector<Record> records_;
};

}  // namespace

std::unique_ptr<PhotographLog> make_memory_log(Grid grid, int channels) {
  return std::make_unique<MemoryLog>(PhotographShape{grid, channels});
}

}  // namespace symrig
