#include "worker/render/render.h"

#include <fmt/format.h>

#include <array>
#include <chrono>
#include <ctime>
#include <utility>

#include "core/base/error.h"
#include "core/film/moments.h"
#include "worker/render/accel/accel.h"
#include "worker/render/camera/ray_camera.h"
#include "worker/render/floating_point_mode.h"
#include "worker/render/integrator/path_tracer.h"
#include "worker/render/light/light_set.h"
#include "worker/render/look.h"

namespace relume::render {
namespace {

// CPU seconds of the calling thread.
double ThreadSeconds() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace

struct BuiltScene::Impl {
    Scene cameras;  // those and the name, nothing else
    Box3f bounds;
    std::shared_ptr<const Look> look;
    Accel accel;
    LightSet lights;
    std::vector<std::string> notes;

    // `before`: of the same scene at another time, with this look.
    Impl(Scene scene, Accel::Reuse reuse, std::shared_ptr<const Look> known, const Impl* before)
        : bounds(scene.Bounds()),
          look(known != nullptr ? std::move(known) : std::make_shared<const Look>(&scene)),
          accel(scene, look->materials(), look->textures(), reuse,
                before == nullptr ? nullptr : &before->accel),
          lights(scene, look->materials(), look->textures(), look->environment(), &accel) {
        cameras.name = scene.name;
        cameras.cameras = scene.cameras;
        if (lights.repaired_environment_values() > 0) {
            notes.push_back(fmt::format(
                "{} NaN, infinite or negative values of the environment map were replaced",
                lights.repaired_environment_values()));
        }
        if (lights.has_moving_emitters()) {
            notes.push_back(
                "surfaces that shine and move are found by chance alone: they bring more noise "
                "than those that stand still");
        }
        notes.push_back(fmt::format("{}; {:.1f} MiB of textures; {} lights", accel.Describe(),
                                    static_cast<double>(look->textures().bytes()) / (1 << 20),
                                    lights.size()));
    }
};

BuiltScene::BuiltScene(Scene scene, bool more_times) {
    CheckCpu();
    const FloatingPointMode mode;
    impl_ = std::make_unique<Impl>(std::move(scene),
                                   more_times ? Accel::Reuse::kLater : Accel::Reuse::kNever,
                                   nullptr, nullptr);
}

BuiltScene::BuiltScene(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

std::shared_ptr<const BuiltScene> BuiltScene::AtAnotherTime(Scene scene) const {
    if (!impl_->look->Fits(scene)) {
        return nullptr;
    }
    const FloatingPointMode mode;
    return std::shared_ptr<const BuiltScene>(new BuiltScene(
        std::make_unique<Impl>(std::move(scene), Accel::Reuse::kLater, impl_->look, impl_.get())));
}

BuiltScene::~BuiltScene() = default;

struct Renderer::Impl {
    std::shared_ptr<const BuiltScene> scene;
    std::vector<std::string> notes;
    RayCamera camera;
    PathTracer tracer;

    Impl(std::shared_ptr<const BuiltScene> built, const BuiltScene::Impl& s,
         const RenderSettings& settings)
        : scene(std::move(built)),
          camera(CompileCamera(ChooseCamera(s.cameras, s.bounds, settings, &notes), settings)),
          tracer(s.accel, s.look->materials(), s.look->textures(), s.lights, camera, settings,
                 s.bounds) {
        if (s.lights.black() && !settings.allow_black) {
            ThrowInvalidArgument(
                "the scene has no light: add one, give --environment MAP.hdr, or --allow-black");
        }
        notes.insert(notes.end(), s.notes.begin(), s.notes.end());
    }
};

Renderer::Renderer(std::shared_ptr<const BuiltScene> scene, const RenderSettings& settings) {
    ValidateSettings(settings);
    const FloatingPointMode mode;
    const BuiltScene::Impl& built = *scene->impl_;
    impl_ = std::make_unique<Impl>(std::move(scene), built, settings);
}

Renderer::Renderer(const std::shared_ptr<const Scene>& scene, const RenderSettings& settings)
    : Renderer(std::make_shared<const BuiltScene>(*scene), settings) {}

Renderer::~Renderer() = default;

const std::vector<std::string>& Renderer::notes() const { return impl_->notes; }

TileResult Renderer::RenderTile(const TileTask& task, const CancelToken& cancel) const {
    const FloatingPointMode mode;
    const double start = ThreadSeconds();
    TileResult result;
    result.rect = task.rect;
    const std::size_t active = task.ActivePixels();
    result.pixels.reserve(active);
    result.planes.resize(active * kFilmChannelCount);
    if (task.keep_samples) {
        result.samples.resize(task.TotalSamples());
    }
    std::size_t traced = 0;

    std::vector<Path> paths(PathTracer::kWave);
    std::array<SampleRequest, PathTracer::kWave> requests;
    std::array<PixelSample, PathTracer::kWave> samples;
    std::size_t queued = 0;

    // Samples are queued pixel after pixel and added in the same order; a wave may span pixels.
    PixelMoments moments;
    std::size_t adding = 0;   // index in result.pixels
    std::uint32_t added = 0;  // samples of that pixel
    const auto flush = [&] {
        std::span<SampleRecord> records;
        if (task.keep_samples) {
            records = std::span(result.samples).subspan(traced, queued);
        }
        result.rays += impl_->tracer.Trace({requests.data(), queued}, paths,
                                           {samples.data(), queued}, records);
        traced += queued;
        for (std::size_t i = 0; i < queued; ++i) {
            const bool good = moments.Add(requests[i].index, samples[i]);
            if (task.keep_samples && !good) {
                result.samples[traced - queued + i] = SampleRecord::Bad();
            }
            if (++added == task.count[result.pixels[adding]]) {
                moments.Store(result.planes.data() + adding, active);
                moments = PixelMoments();
                added = 0;
                ++adding;
            }
        }
        queued = 0;
    };
    for (std::size_t p = 0; p < task.count.size(); ++p) {
        if (task.count[p] == 0) {
            continue;
        }
        result.pixels.push_back(static_cast<std::uint32_t>(p));
        const int x = task.rect.x0 + static_cast<int>(p) % task.rect.width();
        const int y = task.rect.y0 + static_cast<int>(p) / task.rect.width();
        for (std::uint32_t s = 0; s < task.count[p]; ++s) {
            requests[queued++] = {x, y, task.first[p] + s};
            if (queued == PathTracer::kWave) {
                if (cancel.cancelled()) {
                    return {};
                }
                flush();
            }
        }
    }
    flush();
    result.seconds = ThreadSeconds() - start;
    return result;
}

void CheckCpu() {
    if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) {
        throw Error(ErrorCode::kFailedPrecondition,
                    "this CPU lacks AVX2 or FMA: run the worker on a machine that has them");
    }
    CheckEmbree();
}

}  // namespace relume::render
