#include "core/scene/array_room.h"

#include <fmt/format.h>

#include "core/base/error.h"
#include "core/base/resources.h"

namespace relume {
namespace {

std::uint64_t Half() {
    const std::uint64_t memory = AvailableResources().memory;
    return std::min(memory, DataLimit().value_or(memory)) / 2;
}

}  // namespace

ArrayRoom::ArrayRoom(std::uint64_t most) : most_(most == 0 ? Half() : most) {}

void ArrayRoom::Refuse(const SourceLocation& where) const {
    throw Error(ErrorCode::kResourceExhausted,
                fmt::format("{}: with what is asked for here, the scene's arrays take more than {} "
                            "MiB, half of the memory that this process may have; simplify the "
                            "scene, or render it on a larger machine",
                            where, most_ >> 20));
}

}  // namespace relume
