#include "server/store/result_store.h"

#include <gtest/gtest.h>

#include "core/base/error.h"
#include "core/base/files.h"

namespace relume::store {
namespace {

TEST(ResultStore, KeepsReplacesAndRemoves) {
    const TemporaryFolder folder;
    ResultStore store(folder.path() / "results");
    store.Put("7f3a", "first image");
    store.Put("7f3a", "image");
    EXPECT_EQ(store.Read("7f3a", 0, 100), "image");
    EXPECT_EQ(store.Read("7f3a", 2, 2), "ag");
    EXPECT_EQ(store.Read("7f3a", 5, 2), "");
    store.Remove("7f3a");
    store.Remove("7f3a");
    EXPECT_THROW(store.Read("7f3a", 0, 1), Error);
}

TEST(ResultStore, OnlyIdsBecomeFileNames) {
    const TemporaryFolder folder;
    ResultStore store(folder.path());
    for (const std::string& id : {std::string(), std::string("../x"), std::string("a/b"),
                                  std::string("A"), std::string(65, 'a'), std::string("a.b")}) {
        EXPECT_THROW(store.Put(id, "x"), Error) << id;
        EXPECT_THROW(store.Read(id, 0, 1), Error) << id;
    }
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace relume::store
