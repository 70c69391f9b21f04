#include <gtest/gtest.h>

#include <filesystem>

#include "core/base/files.h"
#include "tests/fuzz/read_input.h"

namespace relume::test {
namespace {

namespace fs = std::filesystem;

// Inputs that fuzzing found to do harm once: regressions/KIND/NAME.
std::vector<fs::path> Inputs() {
    std::vector<fs::path> inputs;
    for (const auto& entry :
         fs::recursive_directory_iterator(fs::path(RELUME_SOURCE_DIR) / "tests/fuzz/regressions")) {
        if (entry.is_regular_file()) {
            inputs.push_back(entry.path());
        }
    }
    std::sort(inputs.begin(), inputs.end());
    return inputs;
}

class FuzzRegressions : public testing::TestWithParam<fs::path> {};

TEST_P(FuzzRegressions, EndInASceneOrAnError) {
    const fs::path& path = GetParam();
    const std::string kind = path.parent_path().filename().string();
    const auto& kinds = InputKinds();
    ASSERT_NE(std::find(kinds.begin(), kinds.end(), kind), kinds.end()) << kind;
    EXPECT_NO_THROW(ReadInput(kind, ReadFile(path)));
}

INSTANTIATE_TEST_SUITE_P(All, FuzzRegressions, testing::ValuesIn(Inputs()), [](const auto& param) {
    std::string name =
        param.param.parent_path().filename().string() + "_" + param.param.stem().string();
    std::replace_if(
        name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
    return name;
});

}  // namespace
}  // namespace relume::test
