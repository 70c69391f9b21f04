#include "proto/codec/codec.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <random>

#include "core/base/error.h"
#include "core/base/sha256.h"
#include "core/film/aov.h"

namespace relume::codec {
namespace {

using testing::HasSubstr;

template <typename F>
void ExpectInvalid(const std::string& said, F&& f) {
    try {
        f();
        FAIL() << "taken, although: " << said;
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
        EXPECT_THAT(error.what(), HasSubstr(said));
    }
}

RenderSettings Settings() {
    RenderSettings s;
    s.width = 640;
    s.height = 480;
    s.crop = {10, 20, 30, 40};
    s.seed = 4'000'000'000u;
    s.max_depth = 5;
    s.look = LookCamera{{1, 2, 3}, {4, 5, 6}, {0, 0, 1}, 50};
    s.lens_radius = 0;
    s.focus_distance = 2.5f;
    s.time = 0;
    s.shutter = 0.25f;
    s.environment = "sky.hdr";
    s.environment_scale = 0.5f;
    s.allow_black = true;
    return s;
}

void ExpectEqual(const RenderSettings& a, const RenderSettings& b) {
    EXPECT_EQ(a.width, b.width);
    EXPECT_EQ(a.height, b.height);
    EXPECT_EQ(a.crop, b.crop);
    EXPECT_EQ(a.seed, b.seed);
    EXPECT_EQ(a.max_depth, b.max_depth);
    EXPECT_EQ(a.camera, b.camera);
    EXPECT_EQ(a.look, b.look);
    EXPECT_EQ(a.lens_radius, b.lens_radius);
    EXPECT_EQ(a.focus_distance, b.focus_distance);
    EXPECT_EQ(a.time, b.time);
    EXPECT_EQ(a.shutter, b.shutter);
    EXPECT_EQ(a.environment, b.environment);
    EXPECT_EQ(a.environment_scale, b.environment_scale);
    EXPECT_EQ(a.allow_black, b.allow_black);
}

TEST(CodecSettings, RoundTripOverTheWire) {
    v1::RenderSettings message;
    ASSERT_TRUE(message.ParseFromString(ToProto(Settings()).SerializeAsString()));
    ExpectEqual(FromProto(message), Settings());
    RenderSettings named = Settings();
    named.look.reset();
    named.camera = "front";
    ExpectEqual(FromProto(ToProto(named)), named);
}

TEST(CodecSettings, WhatIsUnsetHasItsDefault) {
    RenderSettings plain;
    plain.width = 8;
    plain.height = 4;
    v1::RenderSettings message;
    message.set_width(8);
    message.set_height(4);
    ExpectEqual(FromProto(message), plain);
    ExpectEqual(FromProto(ToProto(plain)), plain);
}

TEST(CodecSettings, NonsenseIsRefused) {
    const auto with = [](auto&& change) {
        v1::RenderSettings message = ToProto(Settings());
        change(&message);
        return message;
    };
    using M = v1::RenderSettings*;
    ExpectInvalid("size 0x480", [&] { FromProto(with([](M m) { m->set_width(0); })); });
    ExpectInvalid("size 640x-1", [&] { FromProto(with([](M m) { m->set_height(-1); })); });
    ExpectInvalid("size 1000000000x",
                  [&] { FromProto(with([](M m) { m->set_width(1'000'000'000); })); });
    ExpectInvalid("at most", [&] {
        FromProto(with([](M m) {
            m->set_width(65536);
            m->set_height(65536);
        }));
    });
    ExpectInvalid("crop", [&] { FromProto(with([](M m) { m->mutable_crop()->set_x1(641); })); });
    ExpectInvalid("crop", [&] { FromProto(with([](M m) { m->mutable_crop()->set_x1(10); })); });
    ExpectInvalid("crop", [&] { FromProto(with([](M m) { m->mutable_crop()->set_x0(-1); })); });
    ExpectInvalid("finite", [&] { FromProto(with([](M m) { m->set_lens_radius(NAN); })); });
    ExpectInvalid("finite",
                  [&] { FromProto(with([](M m) { m->set_environment_scale(INFINITY); })); });
    ExpectInvalid("finite", [&] { FromProto(with([](M m) { m->set_time(NAN); })); });
    ExpectInvalid("finite", [&] { FromProto(with([](M m) { m->set_shutter(INFINITY); })); });
    ExpectInvalid("depth", [&] { FromProto(with([](M m) { m->set_max_depth(-3); })); });
    ExpectInvalid("depth", [&] { FromProto(with([](M m) { m->set_max_depth(100'000); })); });
}

SceneManifest Manifest() {
    return {"room.gltf",
            {{"room.gltf", 10, Sha256Hex("a")}, {"textures/wood.png", 1ull << 40, Sha256Hex("b")}}};
}

TEST(CodecManifest, RoundTripOverTheWire) {
    v1::SceneManifest message;
    ASSERT_TRUE(message.ParseFromString(ToProto(Manifest()).SerializeAsString()));
    const SceneManifest back = FromProto(message);
    EXPECT_EQ(back.main, "room.gltf");
    ASSERT_EQ(back.entries.size(), 2u);
    EXPECT_EQ(back.entries[1].path, "textures/wood.png");
    EXPECT_EQ(back.entries[1].size, 1ull << 40);
    EXPECT_EQ(back.entries[1].sha256, Sha256Hex("b"));
    EXPECT_EQ(ManifestDigest(back), ManifestDigest(Manifest()));
}

TEST(CodecManifest, PathsAndDigestsThatAreUnsafeAreRefused) {
    for (const char* path : {"../x", "/etc/passwd", "a/../../x", "", "a//b", "./a", "a\\b"}) {
        v1::SceneManifest message = ToProto(Manifest());
        message.mutable_entries(1)->set_path(path);
        ExpectInvalid("must be relative", [&] { FromProto(message); });
    }
    v1::SceneManifest message = ToProto(Manifest());
    message.mutable_entries(1)->set_sha256("ABC");
    ExpectInvalid("SHA-256", [&] { FromProto(message); });
    message = ToProto(Manifest());
    *message.add_entries() = message.entries(1);
    ExpectInvalid("twice", [&] { FromProto(message); });
    message = ToProto(Manifest());
    message.set_main("other.gltf");
    ExpectInvalid("not among", [&] { FromProto(message); });
    ExpectInvalid("not among", [&] { FromProto(v1::SceneManifest()); });
}

TEST(CodecLease, RoundTripWithAndWithoutSharedValues) {
    for (const bool uniform : {true, false}) {
        TileTask task;
        task.rect = {3, 4, 6, 6};
        task.first = uniform ? std::vector<std::uint32_t>(6, 64)
                             : std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5};
        task.count = uniform ? std::vector<std::uint32_t>(6, 8)
                             : std::vector<std::uint32_t>{0, 0, 64, 1, 2, 0};
        v1::Lease lease;
        TaskToLease(task, &lease);
        EXPECT_EQ(lease.sample_count_size(), uniform ? 1 : 6);
        v1::Lease read;
        ASSERT_TRUE(read.ParseFromString(lease.SerializeAsString()));
        const TileTask back = TaskFromLease(read);
        EXPECT_EQ(back.rect, task.rect);
        EXPECT_EQ(back.first, task.first);
        EXPECT_EQ(back.count, task.count);
    }
}

TEST(CodecLease, ShapesThatDisagreeAreRefused) {
    v1::Lease lease;
    TaskToLease({{0, 0, 2, 2}, {0, 0, 0, 0}, {1, 2, 3, 4}}, &lease);
    lease.add_sample_count(5);
    ExpectInvalid("5 per-pixel values for 4 pixels", [&] { TaskFromLease(lease); });
    lease.clear_sample_count();
    ExpectInvalid("0 per-pixel values", [&] { TaskFromLease(lease); });
    for (const TileRect rect :
         {TileRect{0, 0, 0, 4}, TileRect{4, 0, 2, 4}, TileRect{0, 0, 65, 1},
          TileRect{0, 0, 1, 2'000'000'000}, TileRect{-2'000'000'000, 0, 2'000'000'000, 1}}) {
        *lease.mutable_rect() = ToProto(rect);
        ExpectInvalid("tile is empty or larger", [&] { TaskFromLease(lease); });
    }
}

TEST(CodecPlanes, RoundTripKeepsEveryBit) {
    const TileTask task{{0, 0, 3, 1}, {0, 0, 0}, {2, 0, 5}};
    TileResult result;
    result.rect = task.rect;
    result.pixels = {0, 2};
    std::mt19937 random(3);
    for (int i = 0; i < 2 * kFilmChannelCount; ++i) {
        result.planes.push_back(
            std::bit_cast<float>(static_cast<std::uint32_t>(random()) & 0xbfffffffu));
    }
    const std::string bytes = EncodePlanes(result);
    EXPECT_EQ(bytes.size(), 2u * kFilmChannelCount * 4u);
    const TileResult back = DecodePlanes(task, bytes);
    EXPECT_EQ(back.rect, task.rect);
    EXPECT_EQ(back.pixels, result.pixels);
    EXPECT_EQ(EncodePlanes(back), bytes);
}

TEST(CodecPlanes, AnotherSizeIsRefused) {
    const TileTask task{{0, 0, 3, 1}, {0, 0, 0}, {2, 0, 5}};
    const std::string right(2 * kFilmChannelCount * 4, '\0');
    EXPECT_NO_THROW(DecodePlanes(task, right));
    for (const std::string& bytes : {std::string(), right + "x", right.substr(1), right + right}) {
        ExpectInvalid("are due", [&] { DecodePlanes(task, bytes); });
    }
}

TEST(CodecSamples, RoundTripInPartsKeepsEveryBit) {
    const std::size_t samples = std::size_t{2} * kMaxChunk / sizeof(SampleRecord) + 5;
    TileTask task{{0, 0, 2, 1}, {0, 0}, {static_cast<std::uint32_t>(samples) - 3, 3}, true};
    TileResult result;
    std::mt19937 random(3);
    for (std::size_t i = 0; i < samples; ++i) {
        SampleRecord& record = result.samples.emplace_back();
        record.x = static_cast<float>(random() & 0xffff);
        record.random[4] = static_cast<float>(random() & 0xffff);
    }
    result.samples[7] = SampleRecord::Bad();
    const auto chunks = EncodeSamples(result);
    EXPECT_EQ(chunks.size(), 3u);
    std::string bytes;
    for (const std::string& chunk : chunks) {
        EXPECT_LE(chunk.size(), kMaxChunk);
        bytes += chunk;
    }
    EXPECT_EQ(bytes.size(), SampleBytes(task));
    const auto back = DecodeSamples(task, bytes);
    ASSERT_EQ(back.size(), samples);
    EXPECT_EQ(std::memcmp(back.data(), result.samples.data(), bytes.size()), 0);
    EXPECT_TRUE(back[7].bad());
    ExpectInvalid("are due", [&] { DecodeSamples(task, bytes.substr(4)); });
    ExpectInvalid("are due", [&] { DecodeSamples(task, ""); });
    task.keep_samples = false;
    EXPECT_TRUE(DecodeSamples(task, "").empty());
    ExpectInvalid("are due", [&] { DecodeSamples(task, bytes); });
    EXPECT_TRUE(EncodeSamples(TileResult{}).empty());
}

TEST(CodecLease, SaysWhetherSamplesAreKept) {
    for (const bool keep : {false, true}) {
        v1::Lease lease;
        TaskToLease({{0, 0, 2, 1}, {0, 0}, {3, 3}, keep}, &lease);
        EXPECT_EQ(TaskFromLease(lease).keep_samples, keep);
    }
}

TEST(CodecPlanes, AFullTileStaysUnderTheMessageLimit) {
    EXPECT_LE(std::size_t{kMaxTileSide} * kMaxTileSide * kFilmChannelCount * sizeof(float),
              kMaxChunk);
}

}  // namespace
}  // namespace relume::codec
