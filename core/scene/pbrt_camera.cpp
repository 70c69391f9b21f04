#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/scene/pbrt_lights.h"
#include "core/scene/pbrt_motion.h"
#include "core/scene/pbrt_state.h"

namespace relume::pbrt {
namespace {

void ReadHints(const Document& document, Scene* scene, Notes* notes) {
    RenderHints& hints = scene->hints;
    const Params& film = document.film.params;
    if (!document.film.type.empty()) {
        hints.width = film.Int("xresolution", document.version3 ? 640 : 1280);
        hints.height = film.Int("yresolution", document.version3 ? 480 : 720);
        for (const char* name : {"scale", "iso", "exposuretime"}) {
            if (film.Has(name)) {
                notes->Add(document.film.place, fmt::format("the film's exposure ({}) is ignored: "
                                                            "radiance is written as it is",
                                                            name));
            }
        }
        for (const char* name : {"cropwindow", "pixelbounds"}) {
            if (film.Has(name)) {
                notes->Add(document.film.place,
                           fmt::format("the film's {} is ignored: use --crop", name));
            }
        }
        film.Ignore(
            "filename diagonal savefp16 scale iso exposuretime cropwindow pixelbounds "
            "maxsampleluminance maxcomponentvalue sensor whitebalance colorspace "
            "registration");
        film.NoteUnused("film", notes);
    }
    if (!document.sampler.type.empty()) {
        const Params& sampler = document.sampler.params;
        // Grids of 4 x 4 by default, at most 1024 a side for the product to fit.
        const bool grid = document.sampler.type == "stratified";
        const auto side = [&](const char* name) {
            return std::clamp(sampler.Int(name, 4), 0, 1024);
        };
        hints.spp = grid ? side("xsamples") * side("ysamples") : sampler.Int("pixelsamples", 16);
    }
    if (!document.integrator.type.empty()) {
        // pbrt counts bounces, Relume segments.
        hints.max_depth = document.integrator.params.Int("maxdepth", 5) + 1;
    }
    for (int* hint : {&hints.width, &hints.height, &hints.max_depth, &hints.spp}) {
        *hint = *hint > 0 ? *hint : 0;
    }
}

// Four numbers, or those of a frame whose shape differs from the picture's; empty: the default.
std::vector<float> ScreenWindow(const Params& params, const Place& place) {
    const std::vector<float> window = params.Floats("screenwindow");
    const float aspect = params.Float("frameaspectratio", 0);
    if (window.size() == 4) {
        if (!(window[0] < window[1]) || !(window[2] < window[3])) {
            Fail(place, "the camera's screenwindow is empty; correct it");
        }
        return window;
    }
    if (!window.empty()) {
        Fail(place, "the camera's screenwindow must have 4 numbers");
    }
    if (!(aspect > 0)) {
        return {};
    }
    return aspect > 1 ? std::vector<float>{-aspect, aspect, -1, 1}
                      : std::vector<float>{-1, 1, -1 / aspect, 1 / aspect};
}

}  // namespace

std::vector<double> ShutterTimes(const Document& document, const LoadOptions& options) {
    const Params& params = document.camera.params;
    const float from = params.Float("shutteropen", 0), to = params.Float("shutterclose", 1);
    const float open = options.time >= 0 ? options.time : from;
    const float seconds = options.shutter >= 0 ? options.shutter : std::max(to - from, 0.0f);
    return SampleTimes(open, seconds);
}

void ReadCamera(const Document& document, const std::vector<double>& times, Scene* scene,
                Notes* notes) {
    ReadHints(document, scene, notes);
    const Declared& from = document.camera;
    if (from.type.empty()) {
        return;
    }
    const Params& params = from.params;
    Camera camera;
    camera.name = from.type;
    camera.type = from.type;
    camera.source = fmt::format("{}: camera", from.place.Text());
    if (from.type != "perspective" && from.type != "orthographic") {
        Fail(from.place, fmt::format("cameras of type {} are not supported; known: perspective, "
                                     "orthographic",
                                     from.type));
    }
    // pbrt's camera looks along +z, Scene's along -z.
    const auto& ends = document.camera_from_world.at;
    const Ctm to_world{
        {Inverse(ends[0], from.place, "Camera"), Inverse(ends[1], from.place, "Camera")}};
    SampledTransform samples;
    float scale = 1;  // at first
    for (const Transform& sample :
         SampleBetween(to_world, document.transform_times, times, from.place)) {
        Transform rigid;
        float sample_scale = 1;
        if (!SplitScale(sample, &rigid, &sample_scale)) {
            notes->Add(from.place,
                       "the camera's transformation is uneven: only its rotation, place "
                       "and mean scale are used");
        }
        scale = samples.empty() ? sample_scale : scale;
        samples.push_back(rigid * Transform::Scale({1, 1, -1}));
    }
    camera.to_world = samples.front();
    camera.motion = MotionKeys(samples);
    std::vector<float> window = ScreenWindow(params, from.place);
    if (from.type == "perspective") {
        const float fov =
            params.Has("halffov") ? 2 * params.Float("halffov", 45) : params.Float("fov", 90);
        if (!(fov > 0) || !(fov < 180)) {
            Fail(from.place, fmt::format("the camera's fov is {}; it must be above 0 and below 180 "
                                         "degrees",
                                         fov));
        }
        camera.params.Set("fov_short", fov * (kPi / 180));
    } else {
        camera.params.Set("mag_short", scale);
        for (float& side : window) {
            side *= scale;
        }
    }
    if (!window.empty()) {
        camera.params.Set("screen_window", window);
    }
    const float radius = params.Float("lensradius", 0) * scale;
    const float distance = params.Float("focaldistance", 1e6f) * scale;
    if (radius > 0 && distance > 0) {
        camera.params.Set("lens_radius", radius);
        camera.params.Set("focus_distance", distance);
    }
    params.Ignore("shutteropen shutterclose");
    params.NoteUnused(fmt::format("{} camera", from.type), notes);
    scene->cameras.push_back(std::move(camera));
}

}  // namespace relume::pbrt
