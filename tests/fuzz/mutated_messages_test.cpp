#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <random>

#include "tests/fuzz/message_seeds.h"
#include "tests/fuzz/mutate_message.h"
#include "tests/fuzz/read_messages.h"

namespace relume::test {
namespace {

// Calls `once` a number of times, or for so many seconds as RELUME_FUZZ_SECONDS says, with other
// numbers each time then.
void Repeat(int times, const std::function<void(std::mt19937_64*)>& once) {
    const char* seconds = std::getenv("RELUME_FUZZ_SECONDS");
    std::uint64_t done = 0;
    if (seconds == nullptr) {
        std::mt19937_64 random(7);
        for (; done < static_cast<std::uint64_t>(times); ++done) {
            once(&random);
        }
        return;
    }
    const auto end =
        std::chrono::steady_clock::now() + std::chrono::duration<double>(std::atof(seconds));
    std::mt19937_64 random(std::random_device{}());
    for (; std::chrono::steady_clock::now() < end; ++done) {
        once(&random);
    }
    std::cout << done << " inputs\n";
}

std::unique_ptr<google::protobuf::Message> Mutated(const google::protobuf::Message& seed,
                                                   std::mt19937_64* random) {
    std::unique_ptr<google::protobuf::Message> message(seed.New());
    message->CopyFrom(seed);
    MutateMessage(random, message.get());
    return message;
}

TEST(MutatedMessages, OfTheCodecEndInATaskOrAnError) {
    const auto seeds = CodecSeeds();
    Repeat(20'000, [&](std::mt19937_64* random) {
        const CodecSeed& seed = seeds[(*random)() % seeds.size()];
        const auto message = Mutated(*seed.message, random);
        const std::string bytes = seed.kind + message->SerializeAsString();
        EXPECT_NO_THROW(ReadMessages("codec", bytes)) << message->ShortDebugString();
    });
}

TEST(MutatedMessages, OfNewJobsEndInAJobOrAnError) {
    const auto seeds = CodecSeeds();
    Repeat(2000, [&](std::mt19937_64* random) {
        const auto message = Mutated(*seeds.back().message, random);
        EXPECT_NO_THROW(ReadMessages("spec", message->SerializeAsString()))
            << message->ShortDebugString();
    });
}

TEST(MutatedMessages, OfAWorkerChangeNoImage) {
    const auto seeds = WorkSeeds();
    Repeat(300, [&](std::mt19937_64* random) {
        std::string bytes;
        std::string said;
        for (std::uint64_t n = 1 + (*random)() % 24; n > 0; --n) {
            const auto& seed = *seeds[(*random)() % seeds.size()];
            std::unique_ptr<google::protobuf::Message> message(seed.New());
            message->CopyFrom(seed);
            if ((*random)() % 2 == 0) {  // else it is honest
                MutateMessage(random, message.get());
            }
            const std::string part = message->SerializeAsString();
            const auto size = static_cast<std::uint32_t>(part.size());
            bytes.append(reinterpret_cast<const char*>(&size), sizeof size);
            bytes += part;
            said += message->ShortDebugString() + "\n";
        }
        EXPECT_NO_THROW(ReadMessages("work", bytes)) << said;
    });
}

}  // namespace
}  // namespace relume::test
