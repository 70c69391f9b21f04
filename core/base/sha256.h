#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

namespace relume {

// Incremental SHA-256. Not thread-safe.
class Sha256 {
  public:
    Sha256();
    ~Sha256();
    Sha256(Sha256&&) noexcept;
    Sha256& operator=(Sha256&&) noexcept;

    void Update(const void* data, std::size_t size);
    void Update(std::string_view bytes) { Update(bytes.data(), bytes.size()); }

    // 64 lower-case hexadecimal digits. The object is used up.
    std::string HexDigest();

  private:
    struct State;
    std::unique_ptr<State> state_;
};

// The digest of `bytes`, 64 lower-case hexadecimal digits.
std::string Sha256Hex(std::string_view bytes);

// True for 64 lower-case hexadecimal digits: the only form in which a digest becomes a file name.
bool IsSha256Hex(std::string_view text);

}  // namespace relume
