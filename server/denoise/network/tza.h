#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace relume::denoise {

// Numbers with a shape, row-major: weights of a convolution are {outputs, inputs, height, width},
// biases {outputs}.
struct Tensor {
    std::vector<int> shape;
    std::vector<float> values;
};

// Named tensors of a network: "enc_conv0.weight", "enc_conv0.bias", ...
using TensorArchive = std::map<std::string, Tensor>;

// The format of Open Image Denoise's published weights (TZA, major version 2): magic 0x41D7, two
// bytes of version, 64-bit place of the table; the table is a count and for each tensor its name,
// shape, layout ("oihw" or "x"), type ('f' or 'h', 32 or 16 bits) and place. Little-endian. What is
// no such archive throws kInvalidArgument, which names `source`.
TensorArchive ParseTza(std::span<const std::byte> bytes, const std::string& source);
TensorArchive ReadTza(const std::string& path);

enum class TensorType { kFloat, kHalf };

// The same format; halves are rounded to the nearest, even if between two.
std::string FormatTza(const TensorArchive& archive, TensorType type);

}  // namespace relume::denoise
