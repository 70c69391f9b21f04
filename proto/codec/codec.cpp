#include "proto/codec/codec.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "core/base/error.h"
#include "core/film/aov.h"

namespace relume::codec {

static_assert(std::endian::native == std::endian::little, "planes are sent as they lie in memory");

v1::TileRect ToProto(const TileRect& rect) {
    v1::TileRect message;
    message.set_x0(rect.x0);
    message.set_y0(rect.y0);
    message.set_x1(rect.x1);
    message.set_y1(rect.y1);
    return message;
}

TileRect FromProto(const v1::TileRect& rect) {
    return {rect.x0(), rect.y0(), rect.x1(), rect.y1()};
}

namespace {

v1::Vector ToProto(Vec3f v) {
    v1::Vector message;
    message.set_x(v.x);
    message.set_y(v.y);
    message.set_z(v.z);
    return message;
}

Vec3f FromProto(const v1::Vector& v) { return {v.x(), v.y(), v.z()}; }

LookCamera FromProto(const v1::LookCamera& message) {
    LookCamera look;
    look.from = FromProto(message.from());
    look.at = FromProto(message.at());
    if (message.has_up()) {
        look.up = FromProto(message.up());
    }
    if (message.fov_degrees() != 0) {
        look.fov = message.fov_degrees();
    }
    return look;
}

}  // namespace

v1::RenderSettings ToProto(const RenderSettings& s) {
    v1::RenderSettings message;
    message.set_width(s.width);
    message.set_height(s.height);
    if (s.crop != TileRect{}) {
        *message.mutable_crop() = ToProto(s.crop);
    }
    message.set_seed(s.seed);
    message.set_max_depth(s.max_depth);
    message.set_camera(s.camera);
    if (s.lens_radius >= 0) {
        message.set_lens_radius(s.lens_radius);
    }
    if (s.focus_distance >= 0) {
        message.set_focus_distance(s.focus_distance);
    }
    if (s.time >= 0) {
        message.set_time(s.time);
    }
    if (s.shutter >= 0) {
        message.set_shutter(s.shutter);
    }
    message.set_environment(s.environment);
    message.set_environment_scale(s.environment_scale);
    message.set_allow_black(s.allow_black);
    if (s.look) {
        *message.mutable_look()->mutable_from() = ToProto(s.look->from);
        *message.mutable_look()->mutable_at() = ToProto(s.look->at);
        *message.mutable_look()->mutable_up() = ToProto(s.look->up);
        message.mutable_look()->set_fov_degrees(s.look->fov);
    }
    return message;
}

RenderSettings FromProto(const v1::RenderSettings& message) {
    RenderSettings s;
    s.width = message.width();
    s.height = message.height();
    if (message.has_crop()) {
        s.crop = FromProto(message.crop());
    }
    s.seed = message.seed();
    if (message.max_depth() != 0) {
        s.max_depth = message.max_depth();
    }
    s.camera = message.camera();
    if (message.has_lens_radius()) {
        s.lens_radius = message.lens_radius();
    }
    if (message.has_focus_distance()) {
        s.focus_distance = message.focus_distance();
    }
    if (message.has_time()) {
        s.time = message.time();
    }
    if (message.has_shutter()) {
        s.shutter = message.shutter();
    }
    s.environment = message.environment();
    if (message.environment_scale() != 0) {
        s.environment_scale = message.environment_scale();
    }
    s.allow_black = message.allow_black();
    if (message.has_look()) {
        s.look = FromProto(message.look());
    }
    ValidateSettings(s);
    return s;
}

v1::SceneManifest ToProto(const SceneManifest& manifest) {
    v1::SceneManifest message;
    message.set_main(manifest.main);
    for (const auto& entry : manifest.entries) {
        auto* e = message.add_entries();
        e->set_path(entry.path);
        e->set_size(entry.size);
        e->set_sha256(entry.sha256);
    }
    return message;
}

SceneManifest FromProto(const v1::SceneManifest& message) {
    SceneManifest manifest;
    manifest.main = message.main();
    for (const auto& e : message.entries()) {
        manifest.entries.push_back({e.path(), e.size(), e.sha256()});
    }
    ValidateManifest(manifest);
    return manifest;
}

namespace {

void SetPerPixel(const std::vector<std::uint32_t>& values,
                 google::protobuf::RepeatedField<std::uint32_t>* field) {
    bool uniform = !values.empty();
    for (const auto v : values) {
        uniform = uniform && v == values.front();
    }
    if (uniform) {
        field->Add(values.front());
    } else {
        field->Add(values.begin(), values.end());
    }
}

std::vector<std::uint32_t> GetPerPixel(const google::protobuf::RepeatedField<std::uint32_t>& field,
                                       std::size_t pixels) {
    if (field.size() == 1) {
        return std::vector<std::uint32_t>(pixels, field[0]);
    }
    if (static_cast<std::size_t>(field.size()) != pixels) {
        ThrowInvalidArgument(
            fmt::format("lease has {} per-pixel values for {} pixels", field.size(), pixels));
    }
    return {field.begin(), field.end()};
}

}  // namespace

void TaskToLease(const TileTask& task, v1::Lease* lease) {
    *lease->mutable_rect() = ToProto(task.rect);
    SetPerPixel(task.first, lease->mutable_first_sample());
    SetPerPixel(task.count, lease->mutable_sample_count());
    lease->set_keep_samples(task.keep_samples);
}

TileTask TaskFromLease(const v1::Lease& lease) {
    TileTask task;
    task.rect = FromProto(lease.rect());
    const TileRect image{0, 0, kMaxImageSide, kMaxImageSide};  // beyond it differences overflow
    if (task.rect.empty() || !image.Contains(task.rect) || task.rect.width() > kMaxTileSide ||
        task.rect.height() > kMaxTileSide) {
        ThrowInvalidArgument(fmt::format("lease {}: tile is empty or larger than {} pixels a side",
                                         lease.id(), kMaxTileSide));
    }
    task.first = GetPerPixel(lease.first_sample(), task.rect.area());
    task.count = GetPerPixel(lease.sample_count(), task.rect.area());
    task.keep_samples = lease.keep_samples();
    return task;
}

std::string EncodePlanes(const TileResult& result) {
    return {reinterpret_cast<const char*>(result.planes.data()),
            result.planes.size() * sizeof(float)};
}

TileResult DecodePlanes(const TileTask& task, const std::string& planes) {
    TileResult result;
    result.rect = task.rect;
    for (std::size_t i = 0; i < task.count.size(); ++i) {
        if (task.count[i] > 0) {
            result.pixels.push_back(static_cast<std::uint32_t>(i));
        }
    }
    const std::size_t values = result.pixels.size() * kFilmChannelCount;
    if (planes.size() != values * sizeof(float)) {
        ThrowInvalidArgument(fmt::format("result holds {} bytes, {} are due", planes.size(),
                                         values * sizeof(float)));
    }
    result.planes.resize(values);
    std::memcpy(result.planes.data(), planes.data(), planes.size());
    return result;
}

std::vector<std::string> EncodeSamples(const TileResult& result) {
    std::vector<std::string> chunks;
    const char* bytes = reinterpret_cast<const char*>(result.samples.data());
    const std::size_t size = result.samples.size() * sizeof(SampleRecord);
    for (std::size_t begin = 0; begin < size; begin += kMaxChunk) {
        chunks.emplace_back(bytes + begin, std::min(kMaxChunk, size - begin));
    }
    return chunks;
}

std::size_t SampleBytes(const TileTask& task) {
    return task.keep_samples ? task.TotalSamples() * sizeof(SampleRecord) : 0;
}

std::vector<SampleRecord> DecodeSamples(const TileTask& task, const std::string& bytes) {
    if (bytes.size() != SampleBytes(task)) {
        ThrowInvalidArgument(fmt::format("result comes with {} bytes of samples, {} are due",
                                         bytes.size(), SampleBytes(task)));
    }
    std::vector<SampleRecord> samples(bytes.size() / sizeof(SampleRecord));
    if (!samples.empty()) {
        std::memcpy(samples.data(), bytes.data(), bytes.size());
    }
    return samples;
}

}  // namespace relume::codec
