#include "worker/render/light/environment_light.h"

#include <fmt/format.h>
#include <immintrin.h>

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "worker/render/sampler/warp.h"

namespace relume::render {
namespace {

constexpr float kLargest = 65504;    // of a 16-bit float: what an infinity in a map is taken for
constexpr int kLargestSide = 65535;  // first guesses are 16-bit
constexpr float kBelowOne = 0x1.fffffep-1f;

// Cumulative probabilities of `weights`, and for each k the first index whose upper bound is above
// k/n.
void Accumulate(const double* weights, int n, float* cumulative, std::uint16_t* guess) {
    double sum = 0;
    for (int i = 0; i < n; ++i) {
        sum += weights[i];
    }
    double running = 0;
    cumulative[0] = 0;
    for (int i = 0; i < n; ++i) {
        running += sum > 0 ? weights[i] : 1;
        cumulative[i + 1] = static_cast<float>(running / (sum > 0 ? sum : n));
    }
    // The last index with any probability ends at 1 exactly.
    for (int i = n; i > 0 && cumulative[i] == cumulative[n]; --i) {
        if (i < n) {
            cumulative[i] = 1;
        }
    }
    cumulative[n] = 1;
    int at = 0;
    for (int k = 0; k < n; ++k) {
        const float u = static_cast<float>(k) / static_cast<float>(n);
        while (at + 1 < n && cumulative[at + 1] <= u) {
            ++at;
        }
        guess[k] = static_cast<std::uint16_t>(at);
    }
}

}  // namespace

EnvironmentLight::EnvironmentLight(const Scene& scene, const Environment& environment)
    : color_(environment.color), to_world_(environment.to_world) {
    turned_ = !(to_world_ == Transform());
    from_world_ = to_world_.Inverse();
    if (environment.image < 0) {
        mean_ = Average(color_);
        return;
    }
    const SceneImage& image = scene.images.at(static_cast<std::size_t>(environment.image));
    if (image.floats.empty() || image.width < 1 || image.height < 1 || image.width > kLargestSide ||
        image.height > kLargestSide) {
        ThrowInvalidArgument(
            fmt::format("{}: an environment map must hold floats (HDR, EXR), at most {} "
                        "pixels a side",
                        image.name, kLargestSide));
    }
    width_ = image.width;
    height_ = image.height;
    const std::size_t w = static_cast<std::size_t>(width_), h = static_cast<std::size_t>(height_);
    const std::size_t channels = static_cast<std::size_t>(image.channels);
    texels_.resize(w * h);
    cumulative_.resize(h * (w + 1) + h + 1);
    guess_.resize(h * w + h);
    std::vector<double> row(w), marginal(h);
    double sum = 0, sine_sum = 0;
    for (std::size_t y = 0; y < h; ++y) {
        const double sine =
            std::sin(M_PI * (static_cast<double>(y) + 0.5) / static_cast<double>(h));
        for (std::size_t x = 0; x < w; ++x) {
            const float* in = image.floats.data() + (y * w + x) * channels;
            Rgb c{in[0], in[channels >= 3 ? 1 : 0], in[channels >= 3 ? 2 : 0]};
            for (int k = 0; k < 3; ++k) {
                if (!(c[k] >= 0 && c[k] <= std::numeric_limits<float>::max())) {
                    c[k] = c[k] > 0 ? kLargest : 0;
                    ++repaired_;
                }
            }
            c *= color_;
            row[x] = Average(c) * sine;
            marginal[y] += row[x];
            texels_[y * w + x] = {c.x, c.y, c.z, static_cast<float>(row[x])};
        }
        Accumulate(row.data(), width_, &cumulative_[y * (w + 1)], &guess_[y * w]);
        sum += marginal[y];
        sine_sum += sine * static_cast<double>(w);
    }
    Accumulate(marginal.data(), height_, &cumulative_[h * (w + 1)], &guess_[h * w]);
    mean_ = sum / sine_sum;
    // Density in the unit square is weight * w h / sum; the sphere is 2 pi^2 sin times the square.
    pdf_scale_ =
        sum > 0 ? static_cast<float>(static_cast<double>(w * h) / (sum * 2 * M_PI * M_PI)) : 0;
}

EnvironmentLight::Row EnvironmentLight::RowOf(int y) const {
    const std::size_t w = static_cast<std::size_t>(width_), row = static_cast<std::size_t>(y);
    return {&cumulative_[row * (w + 1)], &guess_[row * w], width_};
}

EnvironmentLight::Row EnvironmentLight::Marginal() const {
    const std::size_t w = static_cast<std::size_t>(width_), h = static_cast<std::size_t>(height_);
    return {&cumulative_[h * (w + 1)], &guess_[h * w], height_};
}

int EnvironmentLight::Row::Sample(float* u) const {
    int i = guess[std::min(static_cast<int>(*u * static_cast<float>(n)), n - 1)];
    // Rounding of u n may guess one too far.
    while (i > 0 && cumulative[i] > *u) {
        --i;
    }
    while (i + 1 < n && cumulative[i + 1] <= *u) {
        ++i;
    }
    const float width = cumulative[i + 1] - cumulative[i];
    *u = width > 0 ? std::min((*u - cumulative[i]) / width, kBelowOne) : 0.5f;
    return i;
}

Rgba EnvironmentLight::Interpolate(float x, float y) const {
    x -= 0.5f;
    y -= 0.5f;
    const float fx = std::floor(x), fy = std::floor(y);
    int x0 = static_cast<int>(fx), y0 = static_cast<int>(fy), x1 = x0 + 1, y1 = y0 + 1;
    x0 = x0 < 0 ? width_ - 1 : std::min(x0, width_ - 1);
    x1 = x1 >= width_ ? 0 : x1;
    y0 = std::clamp(y0, 0, height_ - 1);
    y1 = std::clamp(y1, 0, height_ - 1);
    const auto at = [&](int column, int row) {
        return _mm_load_ps(
            &texels_[static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) +
                     static_cast<std::size_t>(column)]
                 .r);
    };
    const auto mix = [](__m128 a, __m128 b, float t) {
        return _mm_add_ps(a, _mm_mul_ps(_mm_sub_ps(b, a), _mm_set1_ps(t)));
    };
    Rgba out;
    _mm_store_ps(&out.r, mix(mix(at(x0, y0), at(x1, y0), x - fx),
                             mix(at(x0, y1), at(x1, y1), x - fx), y - fy));
    return out;
}

Rgb EnvironmentLight::Radiance(Vec3f direction, float* pdf) const {
    if (width_ == 0) {
        if (pdf != nullptr) {
            *pdf = 1 / (4 * kPi);
        }
        return color_;
    }
    const Vec3f d = turned_ ? Normalize(from_world_.Vector(direction)) : direction;
    const float u = 0.5f + std::atan2(d.x, -d.z) * (0.5f * kInvPi);
    const float sine = std::sqrt(d.x * d.x + d.z * d.z);
    const float v = std::atan2(sine, d.y) * kInvPi;  // acos(y), but accurate near the poles
    const Rgba c = Interpolate(u * static_cast<float>(width_), v * static_cast<float>(height_));
    if (pdf != nullptr) {
        *pdf = sine > 0 ? c.a * pdf_scale_ / sine : 0;
    }
    return {c.r, c.g, c.b};
}

bool EnvironmentLight::Sample(Vec2f u, LightSample* sample) const {
    sample->delta = false;
    sample->distance = std::numeric_limits<float>::infinity();
    if (width_ == 0) {
        sample->wi = SampleSphere(u);
        sample->radiance = color_;
        sample->pdf = 1 / (4 * kPi);
        return true;
    }
    // A texel, then a place under its tent; the map is periodic in x and mirrored at the poles.
    const int row = Marginal().Sample(&u.y);
    const int column = RowOf(row).Sample(&u.x);
    const float w = static_cast<float>(width_), h = static_cast<float>(height_);
    float x = static_cast<float>(column) + 0.5f + SampleTent(u.x);
    float y = static_cast<float>(row) + 0.5f + SampleTent(u.y);
    x = x < 0 ? x + w : x >= w ? x - w : x;
    y = y < 0 ? -y : y > h ? 2 * h - y : y;
    const SinCos theta = SinCosTurn(0.5f * y / h), phi = SinCosTurn(x / w);
    // u = x / w is half a turn ahead of the azimuth.
    const Vec3f local{-theta.sin * phi.sin, theta.cos, theta.sin * phi.cos};
    sample->wi = turned_ ? Normalize(to_world_.Vector(local)) : local;
    const Rgba c = Interpolate(x, y);
    sample->radiance = {c.r, c.g, c.b};
    sample->pdf = theta.sin > 0 ? c.a * pdf_scale_ / theta.sin : 0;
    return sample->pdf > 0;
}

}  // namespace relume::render
