#include "core/scene/pbrt_spectra.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/error.h"

namespace relume::pbrt {
namespace {

constexpr float kFirst = 380, kLast = 780, kStep = 5;  // nm

double Lobe(double x, double mean, double below, double above) {
    const double t = (x - mean) / (x < mean ? below : above);
    return std::exp(-0.5 * t * t);
}

// CIE 1931 colour matching functions: Wyman, Sloan, Shirley, "Simple Analytic Approximations to the
// CIE XYZ Color Matching Functions", JCGT 2013, multi-lobe fit; within 1 % of their peaks.
struct Xyz {
    double x, y, z;
};
Xyz Matching(double nm) {
    return {1.056 * Lobe(nm, 599.8, 37.9, 31.0) + 0.362 * Lobe(nm, 442.0, 16.0, 26.7) -
                0.065 * Lobe(nm, 501.1, 20.4, 26.2),
            0.821 * Lobe(nm, 568.8, 46.9, 40.5) + 0.286 * Lobe(nm, 530.9, 16.3, 31.1),
            1.217 * Lobe(nm, 437.0, 11.8, 36.0) + 0.681 * Lobe(nm, 459.0, 26.0, 13.8)};
}

// Relative power of D65 each 10 nm from 380 (CIE 15:2004, table T.1).
constexpr float kD65[] = {49.98f,  54.65f,  82.75f,  91.49f,  93.43f,  86.68f,  104.87f,
                          117.01f, 117.81f, 114.86f, 115.92f, 108.81f, 109.35f, 107.80f,
                          104.79f, 107.69f, 104.41f, 104.05f, 100.00f, 96.33f,  95.79f,
                          88.69f,  90.01f,  89.60f,  87.70f,  83.29f,  83.70f,  80.03f,
                          80.21f,  82.28f,  78.28f,  69.72f,  71.61f,  74.35f,  61.60f,
                          69.89f,  75.09f,  63.59f,  46.42f,  66.81f,  63.38f};

double D65(double nm) {
    const double at = std::clamp((nm - 380) / 10, 0.0, 40.0);
    const auto i = static_cast<std::size_t>(std::min(at, 39.0));
    const double t = at - static_cast<double>(i);
    return kD65[i] * (1 - t) + kD65[i + 1] * t;
}

// The integral of `value`(nm) times the matching functions, over that of the luminosity function
// times `weight`(nm).
template <class Value, class Weight>
Vec3f Integrate(const Value& value, const Weight& weight) {
    double x = 0, y = 0, z = 0, norm = 0;
    for (double nm = kFirst; nm <= kLast; nm += kStep) {
        const Xyz m = Matching(nm);
        const double w = weight(nm), v = value(nm) * w;
        x += v * m.x;
        y += v * m.y;
        z += v * m.z;
        norm += w * m.y;
    }
    return {static_cast<float>(x / norm), static_cast<float>(y / norm),
            static_cast<float>(z / norm)};
}

double One(double) { return 1; }

double Interpolate(const std::vector<float>& samples, double nm) {
    const std::size_t n = samples.size() / 2;
    if (nm <= samples[0]) {
        return samples[1];
    }
    for (std::size_t i = 1; i < n; ++i) {
        const double left = samples[2 * i - 2], right = samples[2 * i];
        if (nm <= right) {
            const double t = (nm - left) / (right - left);
            return samples[2 * i - 1] * (1 - t) + samples[2 * i + 1] * t;
        }
    }
    return samples.back();
}

// Planck's law, relative.
double Planck(double nm, double kelvin) {
    const double m = nm * 1e-9;
    return 1 / (std::pow(nm / 555, 5) * std::expm1(0.0143877688 / (m * kelvin)));
}

Rgb NotNegative(Rgb c) { return Max(c, {0, 0, 0}); }
Rgb Divide(Rgb a, Rgb b) { return {a.x / b.x, a.y / b.y, a.z / b.z}; }

Rgb WithLuminanceOne(Vec3f xyz) {
    return xyz.y > 0 ? NotNegative(XyzToRgb(xyz / xyz.y)) : Rgb{0, 0, 0};
}

}  // namespace

Rgb XyzToRgb(Vec3f c) {
    // IEC 61966-2-1.
    return {3.2404542f * c.x - 1.5371385f * c.y - 0.4985314f * c.z,
            -0.9692660f * c.x + 1.8760108f * c.y + 0.0415560f * c.z,
            0.0556434f * c.x - 0.2040259f * c.y + 1.0572252f * c.z};
}

Rgb SamplesToRgb(const std::vector<float>& samples, SpectrumUse use, bool version3,
                 const Place& place) {
    if (samples.size() < 2 || samples.size() % 2 != 0) {
        Fail(place, "a spectrum is pairs of a wavelength and a value; correct it");
    }
    for (std::size_t i = 2; i < samples.size(); i += 2) {
        if (!(samples[i] > samples[i - 2])) {
            Fail(place, "the wavelengths of a spectrum must rise; sort them");
        }
    }
    const auto value = [&](double nm) { return Interpolate(samples, nm); };
    switch (use) {
        case SpectrumUse::kReflectance:
            return NotNegative(
                Divide(XyzToRgb(Integrate(value, D65)), XyzToRgb(Integrate(One, D65))));
        case SpectrumUse::kLight: {
            const Vec3f xyz = Integrate(value, One);
            return version3 ? NotNegative(XyzToRgb(xyz)) : WithLuminanceOne(xyz);
        }
        case SpectrumUse::kIndex:
            break;
    }
    return NotNegative(Divide(XyzToRgb(Integrate(value, One)), XyzToRgb(Integrate(One, One))));
}

Rgb BlackbodyToRgb(float kelvin) {
    return WithLuminanceOne(Integrate([&](double nm) { return Planck(nm, kelvin); }, One));
}

std::optional<Rgb> Spectra::Find(const Params& params, std::string_view name, SpectrumUse use) {
    if (const Param* param = params.Find(name, "rgb color xyz blackbody spectrum")) {
        return Reduce(*param, use);
    }
    if (const Param* param = params.Find(name, "float")) {
        if (param->numbers.size() != 1) {
            Fail(param->place, fmt::format("'{}' must have one number", param->name));
        }
        return Rgb{1, 1, 1} * param->numbers[0];
    }
    return std::nullopt;
}

Rgb Spectra::Get(const Params& params, std::string_view name, SpectrumUse use, Rgb otherwise) {
    return Find(params, name, use).value_or(otherwise);
}

Rgb Spectra::Reduce(const Param& param, SpectrumUse use) {
    const std::vector<float>& n = param.numbers;
    if (param.type == "blackbody") {
        const bool scaled = n.size() == 2;  // pbrt-v3
        if ((n.size() != 1 && !scaled) || !(n[0] >= 100) || !(n[0] <= 1e6f)) {
            Fail(param.place,
                 fmt::format("'{}' must have a temperature from 100 to 1e6 kelvin", param.name));
        }
        if (!scaled) {
            return BlackbodyToRgb(n[0]);
        }
        const double peak = Planck(2.8977721e6 / n[0], n[0]);  // Wien's displacement law, nm
        return NotNegative(
                   XyzToRgb(Integrate([&](double nm) { return Planck(nm, n[0]) / peak; }, One))) *
               n[1];
    }
    if (param.type == "spectrum") {
        notes_->Add(param.place,
                    "spectra are reduced to RGB: saturated colours differ from spectral "
                    "rendering");
        if (!param.strings.empty()) {
            if (param.strings.size() != 1) {
                Fail(param.place, fmt::format("'{}' must have one name", param.name));
            }
            return Named(param.strings[0], param, use);
        }
        return SamplesToRgb(n, use, version3_, param.place);
    }
    if (n.size() != 3) {
        Fail(param.place, fmt::format("'{}' must have 3 numbers", param.name));
    }
    const Vec3f c{n[0], n[1], n[2]};
    const Rgb rgb = param.type == "xyz" ? NotNegative(XyzToRgb(c)) : c;
    if (std::min(rgb.x, std::min(rgb.y, rgb.z)) < 0) {
        Fail(param.place, fmt::format("'{}' is negative; correct the colour", param.name));
    }
    return rgb;
}

Rgb Spectra::Named(const std::string& name, const Param& param, SpectrumUse use) {
    if (const auto index = NamedIndex(name)) {
        return *index;
    }
    if (const auto illuminant = NamedIlluminant(name)) {
        return *illuminant;
    }
    return SamplesToRgb(ReadFile(name, param.place), use, version3_, param.place);
}

std::vector<float> Spectra::ReadFile(const std::string& path, const Place& place) {
    const std::string name = PathToName(path, place);
    std::vector<float> samples;
    try {
        Tokens tokens(files_, name);
        while (std::optional<Token> token = tokens.Next()) {
            if (!token->text.empty() && token->text.back() == ',') {
                token->text.pop_back();
            }
            samples.push_back(static_cast<float>(ParseNumber(*token, "a wavelength or a value")));
        }
    } catch (const Error& error) {
        throw Error(error.code(),
                    fmt::format("{}: the spectrum '{}' is neither a name that is known nor a file "
                                "of samples: {}",
                                place.Text(), path, error.what()));
    }
    if (std::find(names_.begin(), names_.end(), name) == names_.end()) {
        names_.push_back(name);
    }
    return samples;
}

}  // namespace relume::pbrt
