// SPDX-License-Identifier: Apache-2.0
// libpng reports errors by longjmp. Each phase below is one function with setjmp at its beginning and no
// local that needs a destructor. The caller owns all memory, so no jump skips a destructor.
#include "symrig/image/file.hpp"
#include "symrig/image/internal/codec.hpp"

#include <array>
#include <bit>
#include <csetjmp>
#include <cstring>

#include <png.h>

namespace symrig::image {
namespace {

/// libpng's message; it survives the jump.
struct Failure {
  std::array<char, 128> text{};
};

[[noreturn]] void on_error(png_structp png, png_const_charp message) {
  auto* failure = static_cast<Failure*>(png_get_error_ptr(png));
  std::strncpy(failure->text.data(), message, failure->text.size() - 1);
  png_longjmp(png, 1);
}

void on_warning(png_structp, png_const_charp) {}

struct Source {
  Bytes bytes;
  std::size_t at = 0;
};

void read_bytes(png_structp png, png_bytep out, std::size_t count) {
  auto* source = static_cast<Source*>(png_get_io_ptr(png));
  if (count > source->bytes.size() - source->at) png_error(png, "it ends too early");
  std::memcpy(out, source->bytes.data() + source->at, count);
  source->at += count;
}

class Reader {
 public:
  explicit Reader(Source& source)
      : png_(png_create_read_struct(PNG_LIBPNG_VER_STRING, &failure_, on_error, on_warning)),
        info_(png_ ? png_create_info_struct(png_) : nullptr) {
    if (png_) png_set_read_fn(png_, &source, read_bytes);
  }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
  ~Reader() { png_destroy_read_struct(&png_, &info_, nullptr); }

  bool read_header() {
    if (!info_ || setjmp(png_jmpbuf(png_))) return false;  // NOLINT(cert-err52-cpp): libpng has nothing else
    png_set_user_limits(png_, 0x7FFFFFFFU, 0x7FFFFFFFU);   // checked_grid applies the real limit
    png_set_chunk_malloc_max(png_, png_alloc_size_t{16} << 20);
    png_read_info(png_, info_);
    return true;
  }

  /// Grey or RGB, 8 or 16 bits in the machine's byte order, no alpha.
  bool choose_layout() {
    if (setjmp(png_jmpbuf(png_))) return false;  // NOLINT(cert-err52-cpp)
    if (png_get_color_type(png_, info_) == PNG_COLOR_TYPE_PALETTE) png_set_palette_to_rgb(png_);
    png_set_expand_gray_1_2_4_to_8(png_);
    png_set_strip_alpha(png_);
    if (std::endian::native == std::endian::little) png_set_swap(png_);
    png_set_interlace_handling(png_);
    png_read_update_info(png_, info_);
    return true;
  }

  /// rows: one pointer to row_bytes() bytes for each row.
  bool read_rows(png_bytepp rows) {
    if (setjmp(png_jmpbuf(png_))) return false;  // NOLINT(cert-err52-cpp)
    png_read_image(png_, rows);
    png_read_end(png_, nullptr);
    return true;
  }

  std::int64_t rows() const { return png_get_image_height(png_, info_); }
  std::int64_t cols() const { return png_get_image_width(png_, info_); }
  int bits() const { return png_get_bit_depth(png_, info_); }
  int channels() const { return png_get_channels(png_, info_); }
  std::size_t row_bytes() const { return png_get_rowbytes(png_, info_); }
  std::string failure() const { return std::string("PNG cannot be read: ") + failure_.text.data(); }

 private:
  Failure failure_;
  png_structp png_;
  png_infop info_;
};

template <class Code>
Image<float> to_image(const std::vector<png_byte>& data, std::size_t row_bytes, Grid grid, int channels,
                      float largest) {
  Image<float> image(grid, channels);
  std::vector<Code> codes(row_bytes / sizeof(Code));
  for (int row = 0; row < grid.rows; ++row) {
    std::memcpy(codes.data(), data.data() + static_cast<std::size_t>(row) * row_bytes, row_bytes);
    if (channels == 1) {  // a loop that the compiler makes a vector of
      float* const values = &image.at(row, 0);
      for (int col = 0; col < grid.cols; ++col) values[col] = static_cast<float>(codes[col]) / largest;
      continue;
    }
    std::size_t at = 0;
    for (int col = 0; col < grid.cols; ++col)
      for (int c = 0; c < channels; ++c) image.at(row, col, c) = static_cast<float>(codes[at++]) / largest;
  }
  return image;
}

// NOLINTNEXTLINE(readability-non-const-parameter): libpng fixes the signature
void write_bytes(png_structp png, png_bytep data, std::size_t count) {
  auto* buffer = static_cast<Buffer*>(png_get_io_ptr(png));
  const auto* bytes = reinterpret_cast<const std::byte*>(data);
  try {
    buffer->insert(buffer->end(), bytes, bytes + count);
  } catch (...) {
    buffer = nullptr;  // no exception may pass through libpng's C frames
  }
  if (!buffer) png_error(png, "out of memory");
}

class Writer {
 public:
  explicit Writer(Buffer& buffer)
      : png_(png_create_write_struct(PNG_LIBPNG_VER_STRING, &failure_, on_error, on_warning)),
        info_(png_ ? png_create_info_struct(png_) : nullptr) {
    if (png_) png_set_write_fn(png_, &buffer, write_bytes, nullptr);
  }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;
  ~Writer() { png_destroy_write_struct(&png_, &info_); }

  bool write(Grid grid, int channels, int bits, png_bytepp rows) {
    if (!info_ || setjmp(png_jmpbuf(png_))) return false;  // NOLINT(cert-err52-cpp)
    png_set_IHDR(png_, info_, static_cast<png_uint_32>(grid.cols), static_cast<png_uint_32>(grid.rows), bits,
                 channels == 1 ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_write_info(png_, info_);
    if (bits == 16 && std::endian::native == std::endian::little) png_set_swap(png_);
    png_write_image(png_, rows);
    png_write_end(png_, info_);
    return true;
  }

 private:
  Failure failure_;
  png_structp png_;
  png_infop info_;
};

/// A pointer to the first value of each row.
template <class Byte>
std::vector<png_bytep> row_pointers(std::vector<Byte>& data, std::size_t row_length, int rows) {
  std::vector<png_bytep> pointers;
  pointers.reserve(rows);
  for (int row = 0; row < rows; ++row)
    pointers.push_back(reinterpret_cast<png_bytep>(data.data() + static_cast<std::size_t>(row) * row_length));
  return pointers;
}

template <class Code>
std::vector<Code> interleave(const Image<Code>& image) {
  std::vector<Code> codes;
  codes.reserve(image.values().size());
  for (int row = 0; row < image.grid().rows; ++row)
    for (int col = 0; col < image.grid().cols; ++col)
      for (int c = 0; c < image.channels(); ++c) codes.push_back(image.at(row, col, c));
  return codes;
}

/// Eight pixels in each byte, the leftmost in the highest bit.
std::vector<std::uint8_t> pack_bits(const Image<std::uint8_t>& image, std::size_t row_bytes) {
  std::vector<std::uint8_t> bytes(row_bytes * static_cast<std::size_t>(image.grid().rows));
  for (int row = 0; row < image.grid().rows; ++row)
    for (int col = 0; col < image.grid().cols; ++col)
      if (image.at(row, col) != 0)
        bytes[static_cast<std::size_t>(row) * row_bytes + static_cast<std::size_t>(col / 8)] |=
            static_cast<std::uint8_t>(0x80U >> static_cast<unsigned>(col % 8));
  return bytes;
}

}  // namespace

bool is_png(Bytes bytes) {
  return bytes.size() >= 8 && png_sig_cmp(reinterpret_cast<png_const_bytep>(bytes.data()), 0, 8) == 0;
}

Result<Image<float>> decode_png(Bytes bytes, const std::string& name) {
  Source source{bytes};
  Reader reader(source);
  if (!reader.read_header()) return damaged(name, reader.failure());
  SYMRIG_TRY(const Grid grid, checked_grid(reader.rows(), reader.cols(), name));
  // DEFLATE expands one byte to at most 1,032 bytes.
  if (reader.row_bytes() * static_cast<std::size_t>(grid.rows) / 1032 > bytes.size())
    return damaged(name, "claims more pixels than its bytes can hold");
  if (!reader.choose_layout()) return damaged(name, reader.failure());
  const std::size_t row_bytes = reader.row_bytes();
  std::vector<png_byte> data(row_bytes * static_cast<std::size_t>(grid.rows));
  auto rows = row_pointers(data, row_bytes, grid.rows);
  if (!reader.read_rows(rows.data())) return damaged(name, reader.failure());
  if (reader.bits() == 16) return to_image<std::uint16_t>(data, row_bytes, grid, reader.channels(), 65'535);
  return to_image<std::uint8_t>(data, row_bytes, grid, reader.channels(), 255);
}

template <class Code>
Buffer encode_png_codes(const Image<Code>& image) {
  Buffer buffer;
  auto codes = interleave(image);
  const std::size_t row_length =
      static_cast<std::size_t>(image.grid().cols) * static_cast<std::size_t>(image.channels());
  auto rows = row_pointers(codes, row_length, image.grid().rows);
  Writer writer(buffer);
  if (!writer.write(image.grid(), image.channels(), 8 * static_cast<int>(sizeof(Code)), rows.data()))
    buffer.clear();
  return buffer;
}

template Buffer encode_png_codes(const Image<std::uint8_t>&);
template Buffer encode_png_codes(const Image<std::uint16_t>&);

Buffer encode_png_bits(const Image<std::uint8_t>& image) {
  Buffer buffer;
  const std::size_t row_bytes = (image.grid().cols + 7) / 8;
  auto bytes = pack_bits(image, row_bytes);
  auto rows = row_pointers(bytes, row_bytes, image.grid().rows);
  Writer writer(buffer);
  if (!writer.write(image.grid(), 1, 1, rows.data())) buffer.clear();
  return buffer;
}

}  // namespace symrig::image
