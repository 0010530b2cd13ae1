// SPDX-License-Identifier: Apache-2.0
#include "symrig/rig/camera_ledger.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace symrig {
namespace {

/// After a contradiction at least three frames in a row must agree, even if a stream start needs fewer
/// guards. So a wrong lock needs three consistent errors.
constexpr int kGuardsAfterContradiction = 3;
constexpr std::size_t kPast = 256;      // earlier exposures to which a late frame may belong
constexpr std::size_t kContents = 256;  // earlier frames among which a copy is searched

constexpr std::array<std::string_view, FrameCounts::kVerdicts> kNames{
    "certain", "guard", "damaged", "duplicated", "late", "swapped", "extra", "ambiguous", "doubtful"};

struct Window {
  SteadyTime from, to;
};

/// The possible stamps of a frame that shows this exposure.
Window window_of(const SeenExposure& exposure, StampOf what, const LedgerOptions& options) {
  const Nanoseconds slack = exposure.bound + options.tolerance;
  if (what == StampOf::exposure_begin) return {exposure.begin - slack, exposure.begin + slack};
  return {exposure.end - slack, exposure.end + (slack + options.readout)};
}

bool fits(const SeenFrame& frame, const SeenExposure& exposure, const LedgerOptions& options) {
  const Window window = window_of(exposure, frame.stamp_of, options);
  return window.from <= frame.stamp && frame.stamp <= window.to;
}

}  // namespace

std::string_view name(Verdict verdict) {
  return kNames[static_cast<std::size_t>(verdict)];
}

FrameCounts& FrameCounts::operator+=(const FrameCounts& other) {
  for (std::size_t k = 0; k < kVerdicts; ++k) by_verdict[k] += other.by_verdict[k];
  missing += other.missing;
  return *this;
}

std::string FrameCounts::trouble() const {
  std::string text = missing > 0 ? fmt::format("{} missing", missing) : std::string();
  for (auto k = static_cast<std::size_t>(Verdict::damaged); k < kVerdicts; ++k)
    if (by_verdict[k] > 0) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", by_verdict[k], kNames[k]);
  return text;
}

void CameraLedger::restart() {
  unlock();
  contradicted_ = false;
  stamped_ = false;
  ended_with_gap_ = false;
  past_.clear();
  contents_.clear();
  first_ = 0;
}

void CameraLedger::doubt() {
  unlock();
  contradicted_ = true;
}

void CameraLedger::unlock() {
  offset_.reset();
  candidate_.reset();
  agreed_ = 0;
}

int CameraLedger::guards_needed() const {
  return contradicted_ ? std::max(options_.guards, kGuardsAfterContradiction) : options_.guards;
}

bool CameraLedger::agree(std::int64_t offset) {
  agreed_ = candidate_ == offset ? agreed_ + 1 : 1;
  candidate_ = offset;
  if (agreed_ < guards_needed()) return false;
  offset_ = offset;
  return true;
}

bool CameraLedger::is_copy(std::uint64_t content) const {
  return content != 0 && std::find(contents_.begin(), contents_.end(), content) != contents_.end();
}

void CameraLedger::remember(std::span<const SeenExposure> exposures) {
  first_ += static_cast<std::int64_t>(exposures.size());
  past_.insert(past_.end(), exposures.begin(), exposures.end());
  while (past_.size() > kPast) past_.pop_front();
}

/// Judges one run, frame by frame.
class CameraLedger::Run {
 public:
  Run(CameraLedger& ledger, std::span<const SeenExposure> exposures, std::span<const SeenFrame> frames)
      : ledger_(ledger), exposures_(exposures), frames_(frames), claims_(exposures.size()) {
    out_.frames.resize(frames.size(), Verdict::doubtful);
    out_.frame.resize(exposures.size());
  }

  RunIdentity judge_all() {
    for (const SeenFrame& frame : frames_)
      ledger_.stamped_ = ledger_.stamped_ || frame.stamp_of != StampOf::nothing;
    if (ledger_.stamped_) {
      for (std::size_t k = 0; k < frames_.size(); ++k) judge(k);
    } else {
      judge_by_number();
    }
    finish();
    return std::move(out_);
  }

 private:
  /// What the two witnesses say about a frame. Exposures are numbered from the start of the stream.
  struct Witness {
    std::optional<std::int64_t> by_number, by_stamp;
    bool ambiguous = false;
  };
  struct Claims {
    int count = 0;           // frames that a witness puts at this exposure
    bool contested = false;  // next to a contradiction
  };

  std::int64_t number(std::size_t frame) const { return static_cast<std::int64_t>(frames_[frame].sequence); }

  void look_in(const SeenExposure& exposure, std::int64_t index, const SeenFrame& frame, Witness& witness) {
    if (frame.stamp_of == StampOf::nothing || !fits(frame, exposure, ledger_.options_)) return;
    witness.ambiguous = witness.by_stamp.has_value();
    witness.by_stamp = index;
  }

  Witness ask(std::size_t k) {
    Witness witness;
    if (ledger_.offset_) witness.by_number = number(k) - *ledger_.offset_;
    const std::int64_t oldest = ledger_.first_ - static_cast<std::int64_t>(ledger_.past_.size());
    for (std::size_t i = 0; i < ledger_.past_.size(); ++i)
      look_in(ledger_.past_[i], oldest + static_cast<std::int64_t>(i), frames_[k], witness);
    for (std::size_t i = 0; i < exposures_.size(); ++i)
      look_in(exposures_[i], ledger_.first_ + static_cast<std::int64_t>(i), frames_[k], witness);
    return witness;
  }

  Claims* claims_at(std::optional<std::int64_t> exposure) {
    if (!exposure || *exposure < ledger_.first_) return nullptr;
    const std::size_t i = *exposure - ledger_.first_;
    return i < claims_.size() ? &claims_[i] : nullptr;
  }

  void judge(std::size_t k) {
    const SeenFrame& frame = frames_[k];
    const bool copy = ledger_.is_copy(frame.content);
    if (frame.content != 0) ledger_.contents_.push_back(frame.content);
    if (ledger_.contents_.size() > kContents) ledger_.contents_.pop_front();
    const Witness witness = ask(k);
    const std::optional<Verdict> objection = copy ? Verdict::duplicated : objection_to(k, witness);
    if (objection) return contradict(k, witness, *objection);
    if (!ledger_.offset_) return lock_on(k, *witness.by_stamp);
    accept(k, *witness.by_stamp);
  }

  /// Why number and stamp of a frame contradict. None if they agree.
  std::optional<Verdict> objection_to(std::size_t k, const Witness& witness) {
    if (witness.ambiguous) return Verdict::ambiguous;
    for (std::size_t other = 0; other < k; ++other)
      if (frames_[other].sequence == frames_[k].sequence) return Verdict::duplicated;
    if (!witness.by_stamp) return Verdict::extra;
    if (witness.by_number && *witness.by_number < *witness.by_stamp) return Verdict::late;
    if (witness.by_number && *witness.by_number > *witness.by_stamp) {
      const Claims* there = claims_at(witness.by_stamp);
      return there != nullptr && there->count > 0 ? Verdict::duplicated : Verdict::swapped;
    }
    const Claims* there = claims_at(witness.by_stamp);
    if (there != nullptr && there->count > 0) return Verdict::duplicated;
    return std::nullopt;
  }

  /// The exposures that such a frame may show are not certain. Neither is the frame before it, because the
  /// first error may have gone unnoticed.
  void contradict(std::size_t k, const Witness& witness, Verdict verdict) {
    out_.frames[k] = verdict;
    for (const auto& exposure : {witness.by_number, witness.by_stamp})
      if (Claims* claims = claims_at(exposure)) {
        ++claims->count;
        claims->contested = true;
      }
    if (last_) claims_[*last_].contested = true;
    doubt_twins_of(k);
    ledger_.unlock();
    ledger_.contradicted_ = true;
  }

  /// A copy may arrive before its original. Then the copy was accepted, and is contested now.
  void doubt_twins_of(std::size_t k) {
    for (std::size_t i = 0; i < claims_.size(); ++i) {
      if (!out_.frame[i]) continue;
      const SeenFrame& other = frames_[*out_.frame[i]];
      const bool alike = other.content != 0 && other.content == frames_[k].content;
      if (alike || other.sequence == frames_[k].sequence) claims_[i].contested = true;
    }
  }

  void lock_on(std::size_t k, std::int64_t exposure) {
    const bool trusted_at_once = ledger_.guards_needed() == 0;
    ledger_.agree(number(k) - exposure);
    if (trusted_at_once) return accept(k, exposure);
    guard(k, exposure);
  }

  void guard(std::size_t k, std::int64_t exposure) {
    out_.frames[k] = Verdict::guard;
    if (Claims* claims = claims_at(exposure)) ++claims->count;
  }

  void accept(std::size_t k, std::int64_t exposure) {
    Claims* claims = claims_at(exposure);
    out_.frames[k] = claims == nullptr ? Verdict::late : Verdict::certain;
    if (claims == nullptr && exposure + 1 == ledger_.first_) ledger_.ended_with_gap_ = false;
    if (claims == nullptr) return;  // from an earlier run: known, but useless now
    ++claims->count;
    if (frames_[k].damaged) {
      out_.frames[k] = Verdict::damaged;
      return;
    }
    last_ = static_cast<std::size_t>(exposure - ledger_.first_);
    out_.frame[*last_] = k;
  }

  /// For a camera without stamps. Its numbers must continue without a gap, and the run must be complete. Then
  /// frame k shows exposure k.
  void judge_by_number() {
    bool whole = frames_.size() == exposures_.size();
    for (std::size_t k = 0; k < frames_.size(); ++k) {
      if (ledger_.is_copy(frames_[k].content)) whole = false;
      if (frames_[k].content != 0) ledger_.contents_.push_back(frames_[k].content);
      if (ledger_.contents_.size() > kContents) ledger_.contents_.pop_front();
      whole = whole && number(k) - number(0) == static_cast<std::int64_t>(k);
    }
    if (frames_.empty() && exposures_.empty()) return;
    const std::int64_t offset = frames_.empty() ? 0 : number(0) - ledger_.first_;
    if (!whole || (ledger_.offset_ && *ledger_.offset_ != offset)) return give_up();
    const bool trusted = ledger_.offset_ || ledger_.guards_needed() == 0;
    for (std::size_t k = 0; k < frames_.size(); ++k) {
      if (!ledger_.offset_) ledger_.agree(offset);
      if (trusted) accept(k, ledger_.first_ + static_cast<std::int64_t>(k));
      if (!trusted) guard(k, ledger_.first_ + static_cast<std::int64_t>(k));
    }
  }

  void give_up() {
    for (std::size_t k = 0; k < frames_.size(); ++k)
      out_.frames[k] = k < exposures_.size() ? Verdict::doubtful : Verdict::extra;
    missing_ = exposures_.size() > frames_.size() ? exposures_.size() - frames_.size() : 0;
    ledger_.unlock();
    ledger_.contradicted_ = true;
  }

  bool is_missing(std::size_t exposure) const { return claims_[exposure].count == 0; }

  /// No later frame can contradict the last frame of a run. After a gap it may be a copy of the missing
  /// frame, which may still arrive. So it stays in doubt.
  void doubt_last() {
    if (claims_.empty() || !ledger_.stamped_) return;
    const std::size_t last = claims_.size() - 1;
    const bool gap = last > 0 ? is_missing(last - 1) : ledger_.ended_with_gap_;
    ledger_.ended_with_gap_ = is_missing(last);
    if (gap) claims_[last].contested = true;
  }

  /// Withdraws contested frames, and counts the verdicts.
  void finish() {
    doubt_last();
    std::int64_t missing = 0;
    for (std::size_t i = 0; i < claims_.size(); ++i) {
      missing += is_missing(i);
      if (!claims_[i].contested || !out_.frame[i]) continue;
      out_.frames[*out_.frame[i]] = Verdict::doubtful;
      out_.frame[i].reset();
    }
    if (!ledger_.stamped_ && missing_) missing = static_cast<std::int64_t>(*missing_);
    for (const Verdict verdict : out_.frames) ++out_.counts.by_verdict[static_cast<std::size_t>(verdict)];
    out_.counts.missing = missing;
    ledger_.remember(exposures_);
  }

  CameraLedger& ledger_;
  std::span<const SeenExposure> exposures_;
  std::span<const SeenFrame> frames_;
  std::vector<Claims> claims_;
  std::optional<std::size_t> last_;     // exposure of the newest accepted frame
  std::optional<std::size_t> missing_;  // by count, for a camera without stamps
  RunIdentity out_;
};

RunIdentity CameraLedger::judge(std::span<const SeenExposure> exposures, std::span<const SeenFrame> frames) {
  return Run(*this, exposures, frames).judge_all();
}

}  // namespace symrig
