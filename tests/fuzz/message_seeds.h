#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "google/protobuf/message.h"

namespace relume::test {

// Sound messages to begin with. `kind`: the first byte of a "codec" input.
struct CodecSeed {
    char kind;
    std::unique_ptr<google::protobuf::Message> message;
};
std::vector<CodecSeed> CodecSeeds();
// What an honest worker says in "work", one answer to each of the first leases.
std::vector<std::unique_ptr<google::protobuf::Message>> WorkSeeds();

}  // namespace relume::test
