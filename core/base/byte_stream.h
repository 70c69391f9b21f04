#pragma once

#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "core/base/error.h"

namespace relume {

// Numbers and arrays as they lie in memory, one after the other: for files that only the same build
// on the same kind of machine reads again.
class ByteWriter {
  public:
    template <typename T>
    void Put(const T& value) {
        static_assert(std::is_trivially_copyable_v<T>);
        bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    }
    template <typename T>
    void PutAll(const std::vector<T>& values) {
        Put<std::uint64_t>(values.size());
        PutValues(std::span<const T>(values));
    }
    // Without their number.
    template <typename T>
    void PutValues(std::span<const T> values) {
        static_assert(std::is_trivially_copyable_v<T>);
        if (!values.empty()) {
            bytes_.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
        }
    }
    void PutText(std::string_view text) {
        Put<std::uint64_t>(text.size());
        bytes_.append(text);
    }
    template <typename T>
    void PutOptional(const std::optional<T>& value) {
        Put<std::uint8_t>(value ? 1 : 0);
        if (value) {
            Put(*value);
        }
    }

    // Makes room for so many bytes.
    void Reserve(std::size_t bytes) { bytes_.reserve(bytes); }
    std::string Take() { return std::move(bytes_); }

  private:
    std::string bytes_;
};

// Reads what ByteWriter wrote, in the same order. Bytes that are too few throw kDataLoss.
class ByteReader {
  public:
    explicit ByteReader(std::string_view bytes) : left_(bytes) {}

    template <typename T>
    T Get() {
        static_assert(std::is_trivially_copyable_v<T>);
        T value;
        std::memcpy(&value, Next(sizeof value).data(), sizeof value);
        return value;
    }
    template <typename T>
    std::vector<T> GetAll() {
        static_assert(std::is_trivially_copyable_v<T>);
        const auto count = Get<std::uint64_t>();
        if (count > left_.size() / sizeof(T)) {
            TooFew();
        }
        std::vector<T> values(count);
        if (count > 0) {
            std::memcpy(values.data(), Next(count * sizeof(T)).data(), count * sizeof(T));
        }
        return values;
    }
    std::string_view GetText() { return Next(Get<std::uint64_t>()); }
    template <typename T>
    std::optional<T> GetOptional() {
        return Get<std::uint8_t>() != 0 ? std::optional(Get<T>()) : std::nullopt;
    }

    // Throws kDataLoss unless all was read.
    void End() const {
        if (!left_.empty()) {
            throw Error(ErrorCode::kDataLoss, "saved state is longer than it should be");
        }
    }

  private:
    [[noreturn]] static void TooFew() {
        throw Error(ErrorCode::kDataLoss, "saved state is shorter than it should be");
    }
    std::string_view Next(std::uint64_t count) {
        if (count > left_.size()) {
            TooFew();
        }
        const std::string_view next = left_.substr(0, count);
        left_.remove_prefix(count);
        return next;
    }

    std::string_view left_;
};

}  // namespace relume
