#include "proto/codec/digests.h"

#include <gtest/gtest.h>

#include <functional>
#include <set>
#include <vector>

#include "core/base/error.h"
#include "core/film/aov.h"
#include "proto/codec/codec.h"

namespace relume::codec {
namespace {

TileTask MakeTask() {
    TileTask task;
    task.rect = {16, 8, 20, 10};
    task.first.assign(task.rect.area(), 64);
    task.count.assign(task.rect.area(), 16);
    return task;
}

SceneManifest MakeManifest() {
    return {"a.gltf", {{"a.gltf", 3, std::string(64, 'a')}, {"b.bin", 4, std::string(64, 'b')}}};
}

RenderSettings MakeSettings() {
    RenderSettings settings;
    settings.width = 64;
    settings.height = 48;
    settings.seed = 5;
    settings.camera = "front";
    return settings;
}

TEST(ContextDigest, ChangesWithWhateverDecidesASample) {
    std::set<std::uint64_t> digests{ContextDigest("jobs/a", MakeManifest(), MakeSettings()),
                                    ContextDigest("jobs/b", MakeManifest(), MakeSettings())};
    const std::vector<std::function<void(SceneManifest*, RenderSettings*)>> changes{
        [](auto* m, auto*) { m->entries[1].sha256[7] = 'c'; },
        [](auto* m, auto*) { m->entries[1].path = "c.bin"; },
        [](auto* m, auto*) { m->main = "b.bin"; },
        [](auto*, auto* s) { s->seed ^= 1u << 31; },
        [](auto*, auto* s) { s->max_depth ^= 1; },
        [](auto*, auto* s) { s->width ^= 1; },
        [](auto*, auto* s) { s->camera = "fronu"; },
        [](auto*, auto* s) {
            s->crop = {0, 0, 5, 5};
        },
        [](auto*, auto* s) { s->lens_radius = 0; },
        [](auto*, auto* s) { s->environment_scale = 1.0000001f; },
        [](auto*, auto* s) { s->allow_black = true; },
        [](auto*, auto* s) { s->look.emplace(); },
    };
    for (const auto& change : changes) {
        SceneManifest manifest = MakeManifest();
        RenderSettings settings = MakeSettings();
        change(&manifest, &settings);
        digests.insert(ContextDigest("jobs/a", manifest, settings));
    }
    EXPECT_EQ(digests.size(), 2 + changes.size());
}

TEST(ContextDigest, IsTheSameOfWhatCameByTheWire) {
    RenderSettings settings = MakeSettings();
    settings.lens_radius = 0.25f;
    settings.shutter = -7;  // as good as unset
    settings.camera.clear();
    settings.look.emplace().at = {1, 2, 3};
    EXPECT_EQ(
        ContextDigest("jobs/a", MakeManifest(), settings),
        ContextDigest("jobs/a", FromProto(ToProto(MakeManifest())), FromProto(ToProto(settings))));
}

TEST(TaskDigest, ChangesWithEachFieldAndNotOnTheWire) {
    std::set<std::uint64_t> digests{TaskDigest(1, 2, MakeTask()), TaskDigest(2, 2, MakeTask()),
                                    TaskDigest(1, 3, MakeTask())};
    const std::vector<std::function<void(TileTask*)>> changes{
        [](TileTask* t) { t->first[3] ^= 1u << 20; }, [](TileTask* t) { t->count[7] ^= 1; },
        [](TileTask* t) { std::swap(t->first, t->count); },
        [](TileTask* t) {
            t->rect = {17, 8, 21, 10};
        },
        [](TileTask* t) { t->keep_samples = true; }};
    for (const auto& change : changes) {
        TileTask task = MakeTask();
        change(&task);
        digests.insert(TaskDigest(1, 2, task));
    }
    EXPECT_EQ(digests.size(), 3 + changes.size());

    v1::Lease lease;
    TaskToLease(MakeTask(), &lease);
    EXPECT_EQ(TaskDigest(1, 2, TaskFromLease(lease)), TaskDigest(1, 2, MakeTask()));
}

TEST(Digests, FindAnyBitThatChanged) {
    const TileTask task = MakeTask();
    TileResult result;
    result.rect = task.rect;
    result.planes.assign(task.rect.area() * kFilmChannelCount, 0.5f);
    result.rays = 77;
    result.seconds = 0.25;
    v1::LeaseResult message;
    message.set_planes(EncodePlanes(result));
    SetDigests(TaskDigest(1, 2, task), result, &message);
    CheckTaskDigest(TaskDigest(1, 2, task), message);
    CheckChecksum(result, message);
    EXPECT_THROW(CheckTaskDigest(TaskDigest(1, 3, task), message), Error);

    for (std::size_t bit = 0; bit < message.planes().size() * 8; bit += 13) {
        std::string planes = message.planes();
        planes[bit / 8] = static_cast<char>(planes[bit / 8] ^ (1 << (bit % 8)));
        TileResult changed = DecodePlanes(task, planes);
        changed.rays = result.rays;
        changed.seconds = result.seconds;
        EXPECT_THROW(CheckChecksum(changed, message), Error) << bit;
    }
    TileResult changed = result;
    changed.rays ^= 1;
    EXPECT_THROW(CheckChecksum(changed, message), Error);
    changed = result;
    changed.samples.resize(1);
    EXPECT_THROW(CheckChecksum(changed, message), Error);
}

TEST(Digests, AnAnswerWithoutThemIsRefused) {
    EXPECT_THROW(CheckTaskDigest(1, {}), Error);
    EXPECT_THROW(CheckChecksum({}, {}), Error);
}

}  // namespace
}  // namespace relume::codec
