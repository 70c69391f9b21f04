#include "tests/unit/denoise/synthetic.h"

#include <cmath>

#include "core/base/error.h"
#include "core/film/moments.h"

namespace relume::denoise {

Rgb Truth::Color(int x, int y) const {
    const Rgb albedo = Features(x, y).radiance;
    const float light = 1.5f - static_cast<float>(x) / static_cast<float>(width);
    return albedo * (IsWall(x) ? 0.5f * light : light);
}

// The albedo also stands in `radiance`.
PixelSample Truth::Features(int x, int y) const {
    PixelSample sample;
    sample.radiance = (x / 8 + y / 8) % 2 == 0 ? Rgb{0.8f, 0.7f, 0.6f} : Rgb{0.3f, 0.35f, 0.4f};
    for (int c = 0; c < 3; ++c) {
        sample.features[static_cast<std::size_t>(kAlbedoR + c)] = sample.radiance[c];
    }
    sample.features[IsWall(x) ? kNormalX : kNormalZ] = 1;
    sample.features[kDepth] = IsWall(x) ? 4.0f : 8.0f;
    sample.features[kVisibility] = 1;
    return sample;
}

// What a renderer would keep of the sample; `light`: the random number that its noise is of.
SampleRecord MakeRecord(int x, int y, const PixelSample& sample, double light,
                        std::mt19937* place) {
    SampleRecord record;
    record.x = static_cast<float>(Uniform(place));
    record.y = static_cast<float>(Uniform(place));
    record.radiance = sample.radiance;
    const auto& f = sample.features;
    record.hits[0] = {
        {static_cast<float>(x) + record.x, static_cast<float>(y) + record.y, f[kDepth]},
        {f[kNormalX], f[kNormalY], f[kNormalZ]},
        {f[kAlbedoR], f[kAlbedoG], f[kAlbedoB]}};
    record.random[3] = static_cast<float>(light);
    record.random[4] = static_cast<float>(Uniform(place));
    return record;
}

double Normal(std::mt19937* rng) {
    const double radius = std::sqrt(-2 * std::log1p(-Uniform(rng)));
    return radius * std::cos(6.283185307179586 * Uniform(rng));
}

Film MakeFilm(const TileRect& window, int display_width, int display_height, const Truth& truth,
              int spp, unsigned seed, const SampleHook& hook) {
    std::mt19937 rng(seed), place(seed + 1);
    Film film(window, display_width, display_height);
    TileResult result;
    result.rect = window;
    const std::size_t pixels = window.area();
    result.planes.resize(pixels * kFilmChannelCount);
    for (std::size_t i = 0; i < pixels; ++i) {
        const int x = static_cast<int>(i % static_cast<std::size_t>(window.width()));
        const int y = static_cast<int>(i / static_cast<std::size_t>(window.width()));
        PixelMoments moments;
        for (int s = 0; s < spp; ++s) {
            PixelSample sample = truth.Features(x, y);
            const double light = Uniform(&rng);
            const auto noise = static_cast<float>(-std::log1p(-light));
            sample.radiance = truth.Color(x, y) * noise;
            sample.indirect_luminance = Luminance(sample.radiance);
            if (hook) {
                hook(x, y, s, &sample);
            }
            // Made in any case: the generators must go on alike.
            const SampleRecord record = MakeRecord(x, y, sample, light, &place);
            const bool good = moments.Add(static_cast<std::uint32_t>(s), sample);
            result.samples.push_back(good ? record : SampleRecord::Bad());
        }
        moments.Store(result.planes.data() + i, pixels);
        result.pixels.push_back(static_cast<std::uint32_t>(i));
    }
    if (pixels > 0) {
        film.Merge(result);
    }
    return film;
}

Film MakeFilm(const Truth& truth, int spp, unsigned seed, const SampleHook& hook) {
    return MakeFilm({0, 0, truth.width, truth.height}, truth.width, truth.height, truth, spp, seed,
                    hook);
}

Frame MakeGaussianFrame(const Truth& truth, unsigned seed) {
    constexpr float kVariance = 0.01f;
    std::mt19937 rng(seed), place(seed + 1);
    Frame frame;
    frame.width = truth.width;
    frame.height = truth.height;
    const std::size_t pixels = frame.pixel_count();
    const auto samples = std::make_shared<SampleRecords>(pixels);
    frame.samples = samples;
    frame.count.assign(pixels, 8);
    frame.flagged.assign(pixels, 0);
    for (int c = 0; c < 3; ++c) {
        frame.variance[c].assign(pixels, kVariance);
        frame.sample_variance[c] = frame.variance[c];
        frame.color[c].resize(pixels);
        frame.half[0][c].resize(pixels);
        frame.half[1][c].resize(pixels);
    }
    for (int f = 0; f < kFeatureCount; ++f) {
        frame.feature[f].resize(pixels);
        frame.feature_variance[f].assign(pixels, 1e-3f);
    }
    for (std::size_t i = 0; i < pixels; ++i) {
        const int x = static_cast<int>(i % static_cast<std::size_t>(frame.width));
        const int y = static_cast<int>(i / static_cast<std::size_t>(frame.width));
        const PixelSample features = truth.Features(x, y);
        for (std::size_t f = 0; f < kFeatureCount; ++f) {
            frame.feature[f][i] = features.features[f];
        }
        for (int c = 0; c < 3; ++c) {
            for (auto& half : frame.half) {
                half[c][i] = truth.Color(x, y)[c] +
                             static_cast<float>(std::sqrt(2 * kVariance) * Normal(&rng));
            }
            frame.color[c][i] = 0.5f * (frame.half[0][c][i] + frame.half[1][c][i]);
        }
        for (std::size_t s = 0; s < 8; ++s) {
            PixelSample sample = features;
            const auto& half = frame.half[s % 2];
            sample.radiance = {half[0][i], half[1][i], half[2][i]};
            const SampleRecord record = MakeRecord(x, y, sample, Uniform(&place), &place);
            samples->Append(i, {&record, 1});
        }
    }
    return frame;
}

Frame MakeRandomFrame(int width, int height, unsigned seed) {
    std::mt19937 rng(seed);
    Frame frame;
    frame.width = width;
    frame.height = height;
    const auto fill = [&](Plane* plane, double scale) {
        plane->resize(frame.pixel_count());
        for (float& value : *plane) {
            value = static_cast<float>(scale * Uniform(&rng));
        }
    };
    fill(&frame.count, 16);
    frame.flagged.assign(frame.pixel_count(), 0);
    for (int c = 0; c < 3; ++c) {
        fill(&frame.half[0][c], 1);
        fill(&frame.half[1][c], 1);
        fill(&frame.variance[c], 0.1);
        frame.sample_variance[c] = frame.variance[c];
        frame.color[c].resize(frame.pixel_count());
        for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
            frame.color[c][i] = 0.5f * (frame.half[0][c][i] + frame.half[1][c][i]);
        }
    }
    for (int f = 0; f < kFeatureCount; ++f) {
        fill(&frame.feature[f], f == kDepth ? 9 : 0.5);
        fill(&frame.feature_variance[f], f == kDepth ? 2 : 0.05);
    }
    return frame;
}

double MrSE(const Truth& truth, const Plane (&test)[3], int x0, int x1) {
    double sum = 0;
    for (int y = 0; y < truth.height; ++y) {
        for (int x = x0; x < x1; ++x) {
            const Rgb color = truth.Color(x, y);
            for (int c = 0; c < 3; ++c) {
                const double value = test[c][static_cast<std::size_t>(y * truth.width + x)];
                const double delta = value - color[c];
                sum += delta * delta / (static_cast<double>(color[c]) * color[c] + 0.001);
            }
        }
    }
    return sum / (3.0 * truth.height * (x1 - x0));
}

std::string MessageOf(const std::function<void()>& call) {
    try {
        call();
    } catch (const Error& error) {
        return error.what();
    }
    return "nothing thrown";
}

}  // namespace relume::denoise
