// One libFuzzer program a kind of input: RELUME_FUZZ_KIND, see read_input.h.
#include <google/protobuf/stubs/logging.h>
#include <spdlog/spdlog.h>

#include <cstddef>
#include <cstdint>

#include "core/base/parallel.h"
#include "tests/fuzz/read_input.h"

extern "C" int LLVMFuzzerInitialize(int*, char***) {
    relume::SetThreadCount(1);
    // What is refused would be told some thousand times a second.
    spdlog::set_level(spdlog::level::off);
    google::protobuf::SetLogHandler(nullptr);
    return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    relume::test::ReadInput(RELUME_FUZZ_KIND, {reinterpret_cast<const char*>(data), size});
    return 0;
}
