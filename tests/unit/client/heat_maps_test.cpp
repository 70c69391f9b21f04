#include "client/cli/heat_maps.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "client/lib/output_file.h"
#include "core/base/files.h"

namespace relume::client {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> FilesIn(const fs::path& folder) {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder)) {
        names.push_back(entry.path().filename().string());
    }
    return names;
}

TEST(HeatMaps, OfTheChannelsThatAreThereBesideTheImageOrInAFolder) {
    const TemporaryFolder folder;
    const Image image(3, 2, {"R", "G", "B", "Z", "samples.Y", "decision.Y"});
    fs::create_directory(folder.path() / "maps");
    const std::string path = (folder.path() / "out.final.exr").string();
    const auto beside = WriteHeatMaps(image, path, "");
    ASSERT_EQ(beside.size(), 2u);
    EXPECT_EQ(beside[0].channel, "samples.Y");
    EXPECT_EQ(beside[0].path, (folder.path() / "out.final.samples.png").string());
    EXPECT_EQ(beside[1].channel, "decision.Y");
    EXPECT_THAT(
        FilesIn(folder.path()),
        testing::UnorderedElementsAre("maps", "out.final.samples.png", "out.final.decision.png"));
    for (const auto& map : beside) {
        EXPECT_EQ(ReadFile(map.path).substr(1, 3), "PNG");
    }
    WriteHeatMaps(image, path, (folder.path() / "maps").string());
    EXPECT_THAT(FilesIn(folder.path() / "maps"),
                testing::UnorderedElementsAre("out.final.samples.png", "out.final.decision.png"));
}

TEST(HeatMaps, LeaveNothingIfOneCanNotBeMade) {
    const TemporaryFolder folder;
    fs::create_directory(folder.path() / "out.relmse.png");
    const Image image(3, 2, {"samples.Y", "relmse.Y"});
    EXPECT_THROW(WriteHeatMaps(image, (folder.path() / "out.exr").string(), ""), OutputError);
    EXPECT_THAT(FilesIn(folder.path()), testing::ElementsAre("out.relmse.png"));
}

TEST(HeatMaps, OfAnImageWithoutSuchChannelsAreAnErrorThatNamesThem) {
    try {
        WriteHeatMaps(Image(3, 2, {"R", "G", "B"}), "plain.exr", "");
        FAIL() << "nothing was thrown";
    } catch (const Error& error) {
        EXPECT_THAT(error.what(), testing::HasSubstr("plain.exr"));
        EXPECT_THAT(error.what(), testing::HasSubstr("decision.Y"));
        EXPECT_THAT(error.what(), testing::HasSubstr("--layers all"));
    }
}

}  // namespace
}  // namespace relume::client
