#pragma once

#include <google/protobuf/message.h>

#include <random>

namespace relume::test {

// Changes a few fields of the message, or of those in it, to values that are likely to do harm: the
// ends of their ranges, NaN, what other fields hold, texts with control characters, long ones;
// takes some away and adds some.
void MutateMessage(std::mt19937_64* random, google::protobuf::Message* message);

}  // namespace relume::test
