// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace symrig {

/// Along which axis of the projector a stripe pattern changes.
enum class StripeAxis : std::uint8_t { columns, rows };

/// The axes whose stripes a sequence has.
enum class CodeAxes : std::uint8_t { both, columns, rows };

/// A stripe pattern and its complement.
struct StripePair {
  StripeAxis axis = StripeAxis::columns;
  int bit = 0;           ///< 0 is the most significant
  int stripe_width = 0;  ///< projector pixels from one edge to the next, away from the border
  std::string name;      ///< "columns, 64 px"
};

/// The Gray-code sequence of a projector, in the order of OpenCV's generator: the column bits, most
/// significant first, each followed by its complement; the row bits in the same way; white; black. Gray bit k
/// of position x is bit k of x xor x / 2.
class GrayCode {
 public:
  /// axes: of a sequence of one axis, the other one has no bits.
  explicit GrayCode(Grid projector, CodeAxes axes = CodeAxes::both);

  /// The projector for a number of photographs: 42 → 768x1024, 44 → 800x1280, 46 → 1080x1920; for other
  /// numbers the smallest powers of two. nullopt if no sequence has this number.
  static std::optional<GrayCode> of_length(int photographs);

  Grid projector() const { return projector_; }
  int column_bits() const { return column_bits_; }
  int row_bits() const { return row_bits_; }
  /// An axis of one position has no stripes either.
  CodeAxes axes() const {
    if (row_bits_ == 0 && column_bits_ > 0) return CodeAxes::columns;
    return column_bits_ == 0 && row_bits_ > 0 ? CodeAxes::rows : CodeAxes::both;
  }
  int pairs() const { return column_bits_ + row_bits_; }
  int photographs() const { return 2 * pairs() + 2; }
  int white() const { return 2 * pairs(); }
  int black() const { return 2 * pairs() + 1; }

  StripePair pair(int index) const;
  /// Number of bits of an axis.
  int bits(StripeAxis axis) const { return axis == StripeAxis::columns ? column_bits_ : row_bits_; }
  /// Whether the pattern of a pair (not its complement) lights this position of its axis.
  bool lit(int pair, int position) const;
  /// The pattern of photograph `index`: values 0 or 1.
  Pattern pattern(int index) const;

 private:
  Grid projector_;
  int column_bits_, row_bits_;
};

/// All patterns of the sequence.
/// shapes: 2 (bits of columns + bits of rows) + 2 patterns of `projector`.
std::vector<Pattern> gray_code_patterns(Grid projector);

/// The photographs of one Gray-code sequence.
struct CodePhotographs {
  GrayCode code;
  std::vector<std::string> names;    ///< file names, in the order of the sequence
  std::vector<Image<float>> images;  ///< 1 channel, linear, 1 = the largest code of the file
  /// The complements were not photographed: they are white + black − pattern.
  bool complements_derived = false;
  /// The value of a saturated pixel: 1, or less if the largest code of the camera is not that of the file.
  float saturation = 1;
  /// White's brightest channel, if it was photographed in colours, once. Luminance is below 1 where one
  /// channel is full. Empty: white itself.
  Image<float> white_peak = {};

  const Image<float>& image(int photograph) const { return images[photograph]; }
  const Image<float>& white() const { return images[code.white()]; }
  const Image<float>& black() const { return images[code.black()]; }
  Grid camera() const { return images.front().grid(); }
};

struct ReadCodeOptions {
  std::optional<Grid> projector =
      {};  ///< default: derived from the number of photographs (GrayCode::of_length)
  Progress progress = {};
};

/// Makes a sequence of photographs in its order. By their number, they may lack the complements, or the pairs
/// of rows, or both. Where the number allows two of these, they have complements if neighbours add up to
/// white + black. Missing complements are derived.
/// fails: size_mismatch (another number; several sizes).
Result<CodePhotographs> arrange_code_photographs(Grid projector, std::vector<Image<float>> images,
                                                 std::vector<std::string> names);

/// Reads a folder of photographs: every .png, .exr and .pfm file in it, in natural order of the names (2
/// before 10); or the files of its capture.toml (capture_file.hpp). Colour becomes luminance. With a given
/// projector, a sequence without complements or of columns alone is read too (arrange_code_photographs).
/// fails: not_found (no folder, no pictures), size_mismatch (a number that no sequence of the projector has;
/// photographs of several sizes), bad_value (white is not brighter than black), as read_image and
/// read_capture_file, interrupted.
Result<CodePhotographs> read_gray_code_folder(const std::filesystem::path& folder,
                                              const ReadCodeOptions& options = {});

/// fails: size_mismatch (photographs of several sizes or channels; names the first).
Result<void> check_same_size(const CodePhotographs& photographs);

/// The same checks on photographs already in memory.
Result<void> check_gray_code(const CodePhotographs& photographs);

}  // namespace symrig
